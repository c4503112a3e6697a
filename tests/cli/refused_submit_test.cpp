// Submitting with a key that ends on the way: what has arrived is asked for, and told before the refusal.
#include <gmock/gmock.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <thread>

#include "pipeline/io/volume_file.h"
#include "tests/support/hinge_study.h"
#include "tests/support/program_test.h"
#include "tests/support/served.h"

namespace kvx {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing_support::Ended;
using testing_support::Served;
using testing_support::WriteHingeStudy;

class RefusedSubmit : public testing_support::ProgramTest {
 protected:
  ~RefusedSubmit() override { unsetenv("KINEVOX_TOKEN"); }
  json UseKey(const std::string& gib_per_day) const {
    json key = RunJson({"keys", "add", "--data", At("data"), "--name", "a", "--gib-per-day", gib_per_day});
    setenv("KINEVOX_TOKEN", key["key"].get<std::string>().c_str(), 1);
    return key;
  }
  std::filesystem::path Study(const char* name) const {
    std::filesystem::create_directories(scratch.path() / name);
    return WriteHingeStudy(scratch.path() / name);
  }
  const Served server{scratch.path() / "data", {"--set", "auth.api_keys=true", "--workers", "0"}};
};

// The second study's scan is the first file that is too much.
TEST_F(RefusedSubmit, WhatArrivedBeforeAQuotaWasUsedUpIsBuilt) {
  const auto first = Study("first"), second = Study("second");
  Scan scan = ReadScan(second.parent_path() / "pose01.nii.gz");
  for (float& value : scan.volume.values) value += 1;
  WriteVolume(second.parent_path() / "pose01.nii.gz", scan.volume, scan.stored_as);
  uintmax_t bytes = 20'000;  // and what is said about them
  for (const char* file : {"pose00.nii.gz", "pose01.nii.gz", "pose02.nii.gz", "bones.nii.gz"})
    bytes += std::filesystem::file_size(first.parent_path() / file);
  UseKey(std::to_string(double(bytes) / (1 << 30)));
  const Ended ended = Run({"submit", first.string(), second.string(), "--server", server.url(), "--json"});
  EXPECT_EQ(ended.code, 6) << ended.err;
  EXPECT_THAT(ended.err, HasSubstr("used up"));
  const json told = json::parse(ended.out, nullptr, false);
  ASSERT_TRUE(told.contains("studies")) << ended.out;
  EXPECT_EQ(told["studies"][0]["state"], "queued");
  EXPECT_EQ(told["studies"][0]["batch"], told["batch"]);
  EXPECT_EQ(told["studies"][1]["state"], "failed");
}

TEST_F(RefusedSubmit, AKeyThatEndsDuringTheWaitDoesNotHideTheJob) {
  const auto study = Study("study");
  const json key = UseKey("1");
  const json sent = RunJson({"submit", study.string(), "--server", server.url()});
  const std::filesystem::path waiting = scratch.path() / "waiting";
  std::filesystem::create_directories(waiting);
  testing_support::Program submit(
      waiting, {"submit", study.string(), "--server", server.url(), "--wait", "--json", "--quiet"});
  std::this_thread::sleep_for(std::chrono::seconds(2));
  EXPECT_EQ(Run({"keys", "revoke", key["id"], "--data", At("data")}).code, 0);
  const Ended ended = submit.Wait();
  EXPECT_EQ(ended.code, 6) << ended.err;
  EXPECT_EQ(json::parse(ended.out, nullptr, false)["job"], sent["job"]) << ended.out;
}

}  // namespace
}  // namespace kvx
