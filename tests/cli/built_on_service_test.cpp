// What a client gets of a model that a service has built.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "server/http_library.h"
#include "tests/support/hinge_study.h"
#include "tests/support/program_test.h"
#include "tests/support/served.h"

namespace kvx {
namespace {

using nlohmann::json;

class BuiltOnService : public testing_support::ProgramTest {
 protected:
  BuiltOnService() {
    const std::string study = testing_support::WriteHingeStudy(scratch.path()).string();
    model = RunJson({"submit", study, "--server", server.url(), "--wait", "--quiet"})["id"];
  }
  const testing_support::Served server{scratch.path() / "data"};
  std::string model;
};

// Sent over HTTP by themselves; `submit` leaves fields out that nobody reads.
TEST_F(BuiltOnService, FieldsOfItsBonesThatNobodyReadsAreTold) {
  httplib::Client http(server.url());
  http.set_read_timeout(60);
  json request{{"template", "pose00"}, {"scans", {"pose00", "pose01"}}};
  request["subject"] = json::parse(http.Get("/v1/models/" + model)->body)["subject"];
  request["bones"]["list"] = {{{"label", 1}, {"name", "upper"}, {"parnet", "lower"}},
                              {{"label", 2}, {"name", "lower"}, {"parent", "upper"}}};
  json moved = json::array({1, 0, 0, 2, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  request["initial_poses"]["pose00"]["lower"] = moved;
  const auto accepted = http.Post("/v1/models", request.dump(), "application/json");
  ASSERT_TRUE(accepted && accepted->status == 202) << accepted->body;
  const std::string job = "/v1/jobs/" + json::parse(accepted->body)["job"].get<std::string>() + "?wait=30";
  json now = {{"state", "queued"}};
  while (now["state"] == "queued" || now["state"] == "running") now = json::parse(http.Get(job)->body);
  const std::string warnings = now["result"]["warnings"].dump();
  EXPECT_NE(warnings.find("misspelt? bones.list[0].parnet"), std::string::npos) << warnings;
  EXPECT_NE(warnings.find("another scan: lower"), std::string::npos) << warnings;
}

// They have no header of their own.
TEST_F(BuiltOnService, RawVoxelsComeWithTheirGeometry) {
  const std::vector<std::string> fetch{"fetch",  model,   "--server",       server.url(), "--scan",
                                       "pose01", "--out", At("voxels.raw"), "--quiet"};
  const json raw = RunJson(fetch);
  ASSERT_EQ(raw["size"].size(), 3u) << raw;
  EXPECT_EQ(raw["spacing"][0], 1.25);
  EXPECT_EQ(raw["origin"].size(), 3u);
  EXPECT_EQ(raw["direction"].size(), 9u);
  EXPECT_EQ(raw["type"], "uint8");
  EXPECT_EQ(raw["bytes"], raw["size"][0].get<int>() * raw["size"][1].get<int>() * raw["size"][2].get<int>());
  EXPECT_NE(Run(fetch).err.find("spacing 1.25,"), std::string::npos);
}

TEST_F(BuiltOnService, AMotionOfTooManyFramesIsRefusedBeforeAnyIsPosed) {
  const std::string motion = R"({"fps": 1000, "frames": [{"time": 0, "joints": {}},
      {"time": 99, "joints": {"nobody.flexion": 1}}]})";
  const auto refused =
      httplib::Client(server.url()).Post("/v1/models/" + model + "/animations", motion, "application/json");
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->status, 400) << refused->body;
}

}  // namespace
}  // namespace kvx
