// Keys, audit, backup and the API's document, with the real program on loopback.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "pipeline/io/volume_file.h"
#include "tests/support/environment.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_study.h"
#include "tests/support/program_test.h"
#include "tests/support/served.h"
#include "tests/support/small_disk.h"

namespace kvx {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing_support::Content;
using testing_support::Ended;
using testing_support::Environment;
using testing_support::LinearRamp;
using testing_support::ObliqueGrid;
using testing_support::Served;

class Operations : public testing_support::ProgramTest {};

TEST_F(Operations, AFolderOfOtherThingsIsNotFilled) {
  std::filesystem::create_directory(At("photos"));
  std::ofstream(At("photos/a.jpg")) << "a";
  EXPECT_EQ(Run({"worker", "--data", At("typo")}).code, 5);
  EXPECT_EQ(Run({"worker", "--data", At("photos")}).code, 5);
  EXPECT_EQ(Run({"keys", "add", "--name", "a", "--data", At("photos")}).code, 5);
  const Ended serve = Run({"serve", "--data", At("photos"), "--listen", "127.0.0.1:0"});
  EXPECT_EQ(serve.code, 5);
  EXPECT_THAT(serve.err, HasSubstr(At("photos") + " holds other things"));
  EXPECT_FALSE(std::filesystem::exists(At("typo")));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(At("photos")), {}), 1);
}

TEST_F(Operations, WhatTheServiceKeepsIsForItsUserAlone) {
  namespace fs = std::filesystem;
  const Ended key = Run({"keys", "add", "--name", "a", "--data", At("data")});
  ASSERT_EQ(key.code, 0) << key.err;
  EXPECT_THAT(key.err, HasSubstr("new data folder"));
  fs::create_directory(At("open"));  // as mkdir makes it
  for (const char* data : {"data", "open"}) {
    Served server(scratch.path() / data);
    ASSERT_EQ(server.Stop(SIGTERM).code, 0) << data;
    const auto others = fs::perms::group_all | fs::perms::others_all;
    for (const auto& entry : fs::directory_iterator(At(data)))
      EXPECT_EQ(entry.status().permissions() & others, fs::perms::none) << entry.path();
  }
  EXPECT_EQ(fs::status(At("data")).permissions(), fs::perms::owner_all);
}

TEST_F(Operations, ACertificateThatIsNotTrustedIsNamed) {
  const std::string make =
      "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 "
      "-subj /CN=127.0.0.1 -addext subjectAltName=IP:127.0.0.1 -keyout " +
      At("key.pem") + " -out " + At("cert.pem") + " 2>/dev/null";
  if (std::system(make.c_str()) != 0) GTEST_SKIP() << "openssl is not installed";
  const Served server(scratch.path() / "data",
                      {"--tls-certificate", At("cert.pem"), "--tls-key", At("key.pem")});
  const Ended ended = Run({"jobs", "--server", server.url()});
  EXPECT_EQ(ended.code, 4);
  EXPECT_THAT(ended.err, HasSubstr("certificate"));
  EXPECT_THAT(ended.err, HasSubstr("KINEVOX_CA"));
  const Environment authority("KINEVOX_CA", At("cert.pem"));
  EXPECT_EQ(Run({"jobs", "--server", server.url()}).code, 0);
}

TEST_F(Operations, TheNextMinuteIsWaitedForAloud) {
  const Served server(scratch.path() / "data", {"--set", "auth.api_keys=true"});
  const json key =
      RunJson({"keys", "add", "--data", At("data"), "--name", "a", "--requests-per-minute", "1"});
  const Environment token("KINEVOX_TOKEN", key["key"]);
  std::string told;
  for (int i = 0; i < 3 && told.empty(); ++i) {
    testing_support::Program jobs(scratch.path(), {"jobs", "--server", server.url()});
    for (int pauses = 0; pauses < 300 && jobs.Running(); ++pauses)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    if (jobs.Running()) jobs.Signal(SIGINT);
    told = jobs.Wait().err;
  }
  EXPECT_EQ(told, "kinevox: waiting: your requests of this minute are used up\n");
}

// A key is shown once: who does not get it must hear of that.
TEST_F(Operations, WhatCannotBePrintedIsAFailure) {
  for (const char* command : {"keys add --name ci", "keys list", "keys list --json", "audit list"}) {
    const std::string line =
        std::string(KVX_PROGRAM) + " " + command + " --data " + At("data") + " > /dev/full 2> " + At("err");
    EXPECT_EQ(WEXITSTATUS(std::system(line.c_str())), 4) << command;
    EXPECT_THAT(Content(At("err")), HasSubstr("cannot be written to stdout")) << command;
  }
}

TEST_F(Operations, KeysCountAtOnceBesideARunningService) {
  Served server(scratch.path() / "data", {"--set", "auth.api_keys=true"});
  const Ended nobody = Run({"jobs", "--server", server.url()});
  EXPECT_EQ(nobody.code, 6) << "no token";
  EXPECT_THAT(nobody.err, HasSubstr("KINEVOX_TOKEN"));
  const json key =
      RunJson({"keys", "add", "--data", At("data"), "--name", "ci", "--project", "lab", "--days", "1"});
  {
    const Environment token("KINEVOX_TOKEN", key["key"]);
    EXPECT_EQ(Run({"jobs", "--server", server.url()}).code, 0);
    EXPECT_EQ(Run({"jobs", "--server", "http://192.0.2.1:8080"}).code, 2) << "no token in the clear";
    const Ended list = Run({"keys", "list", "--data", At("data")});
    EXPECT_THAT(list.out, HasSubstr(key["id"].get<std::string>()));
    EXPECT_THAT(list.out, testing::Not(HasSubstr(key["key"].get<std::string>().substr(40))));
    EXPECT_EQ(Run({"keys", "revoke", key["id"], "--data", At("data")}).code, 0);
    EXPECT_EQ(Run({"jobs", "--server", server.url()}).code, 6) << "revoked";
  }
  EXPECT_EQ(server.Stop(SIGTERM).code, 0);
  EXPECT_THAT(server.Stop(SIGTERM).err, testing::Not(HasSubstr(key["key"].get<std::string>())))
      << "in the log";
  const json check = RunJson({"audit", "verify", "--data", At("data")});
  EXPECT_EQ(check["entries"], 4) << "added, refused twice, revoked";
  EXPECT_EQ(Run({"audit", "verify", "--data", At("data"), "--head", check["head"]}).code, 0);
  EXPECT_EQ(Run({"audit", "verify", "--data", At("data"), "--head", std::string(64, 'a')}).code, 3);
  const std::string short_head = check["head"].get<std::string>().substr(0, 12);
  const Ended abbreviated = Run({"audit", "verify", "--data", At("data"), "--head", short_head});
  EXPECT_EQ(abbreviated.code, 3);
  EXPECT_THAT(abbreviated.err, testing::AllOf(HasSubstr("64 digits"), testing::Not(HasSubstr("cut off"))));
  const json newest = RunJson({"audit", "list", "--data", At("data")})["items"];
  EXPECT_EQ(newest[0]["action"], "GET /v1/jobs") << "refused after";
  EXPECT_EQ(newest[1]["action"], "keys revoke");
  EXPECT_EQ(Run({"keys", "list", "--data", At("nowhere")}).code, 5);
}

bool IsOpenToOthers(const std::filesystem::path& path) {
  using std::filesystem::perms;
  return (std::filesystem::status(path).permissions() & (perms::group_all | perms::others_all)) !=
         perms::none;
}

TEST_F(Operations, ABackupOfARunningServiceIsAServiceAgain) {
  std::filesystem::create_directory(scratch.path() / "study");
  const auto study = testing_support::WriteHingeStudy(scratch.path() / "study");
  std::string model;
  {
    Served server(scratch.path() / "data");
    model = RunJson({"submit", study.string(), "--server", server.url(), "--quiet", "--wait"})["id"];
    ASSERT_EQ(
        Run({"fetch", model, "--server", server.url(), "--scan", "pose01", "--out", At("a.nrrd"), "--quiet"})
            .code,
        0);
    EXPECT_GT(RunJson({"backup", "--data", At("data"), "--out", At("copy")})["files"], 5);
    EXPECT_LT(RunJson({"backup", "--data", At("data"), "--out", At("copy")})["files"], 3)
        << "only what is new";
    EXPECT_THAT(Run({"backup", "--data", At("data"), "--out", "/proc/nowhere"}).err,
                HasSubstr("the backup cannot"));
    for (const char* out : {"data", "data/copy", "copy/../data", "."})
      EXPECT_EQ(Run({"backup", "--data", At("data"), "--out", At(out)}).code, 3) << out;
  }
  for (const char* name : {"copy", "copy/kinevox.db", "copy/blobs"})
    EXPECT_FALSE(IsOpenToOthers(At(name))) << name;
  std::filesystem::remove_all(scratch.path() / "data");
  EXPECT_EQ(Run({"restore", "--from", At("nothing"), "--data", At("new")}).code, 5);
  EXPECT_THAT(Run({"restore", "--from", At("copy"), "--data", At("new")}).err, HasSubstr("copying"));
  EXPECT_EQ(Run({"restore", "--from", At("copy"), "--data", At("new")}).code, 3) << "not empty";
  for (const char* name : {"new", "new/kinevox.db"}) EXPECT_FALSE(IsOpenToOthers(At(name))) << name;
  Served server(scratch.path() / "new");
  ASSERT_EQ(
      Run({"fetch", model, "--server", server.url(), "--scan", "pose01", "--out", At("b.nrrd"), "--quiet"})
          .code,
      0);
  EXPECT_EQ(Content(At("b.nrrd")), Content(At("a.nrrd")));
  for (const auto& blob : std::filesystem::recursive_directory_iterator(scratch.path() / "copy" / "blobs")) {
    if (!blob.is_regular_file()) continue;
    std::ofstream(blob.path(), std::ios::app) << "x";
    break;
  }
  const Ended damaged = Run({"restore", "--from", At("copy"), "--data", At("other")});
  EXPECT_EQ(damaged.code, 3);
  EXPECT_THAT(damaged.err, HasSubstr("damaged"));
}

// Runs the program where the folder `data` cannot be written, as a snapshot cannot.
class ReadOnly : public Operations {
 protected:
  int RunReadOnly(const std::string& arguments) const {
    const std::string data = At("data");
    return Shell("mount --bind " + data + " " + data + " && mount -o remount,bind,ro " + data + " && exec " +
                 KVX_PROGRAM + " " + arguments + " --data " + data + " >" + At("out") + " 2>&1");
  }
  static int Shell(const std::string& command) {
    return WEXITSTATUS(std::system(("unshare -rm sh -c '" + command + "'").c_str()));
  }
};

TEST_F(ReadOnly, ASnapshotCanBeReadAndCopied) {
  if (Shell("mount --bind " + scratch.path().string() + " " + scratch.path().string()) != 0)
    GTEST_SKIP() << "this user may not mount in a namespace of its own (unshare -rm)";
  ASSERT_EQ(Run({"keys", "add", "--name", "ci", "--data", At("data")}).code, 0);
  EXPECT_EQ(RunReadOnly("keys list"), 0) << Content(At("out"));
  EXPECT_THAT(Content(At("out")), HasSubstr("ci"));
  EXPECT_EQ(RunReadOnly("audit verify"), 0) << Content(At("out"));
  EXPECT_EQ(RunReadOnly("backup --out " + At("copy")), 0) << Content(At("out"));
  EXPECT_EQ(Run({"restore", "--from", At("copy"), "--data", At("new")}).code, 0);
  EXPECT_EQ(RunReadOnly("keys revoke key_none"), 4);
  EXPECT_THAT(Content(At("out")), HasSubstr("read-only"));
  std::ofstream(At("data/kinevox.db-wal")) << "changes";
  for (const char* command : {"keys list", "audit verify"}) {
    EXPECT_EQ(RunReadOnly(command), 4) << command;
    EXPECT_THAT(Content(At("out")), HasSubstr("copy the whole folder"));
  }
}

TEST_F(Operations, AJobDoesNotBuildFromDamagedUploads) {
  std::filesystem::create_directory(scratch.path() / "study");
  const auto study = testing_support::WriteHingeStudy(scratch.path() / "study");
  json named = json::parse(Content(study));
  named["scans"][0]["name"] = named["template"] = "Mueller_1970";
  std::ofstream(study) << named;
  const Served server(scratch.path() / "data", {"--workers", "0"});
  const json sent = RunJson({"submit", study.string(), "--server", server.url(), "--quiet"});
  for (const auto& blob : std::filesystem::recursive_directory_iterator(scratch.path() / "data" / "blobs")) {
    if (blob.is_regular_file()) std::ofstream(blob.path(), std::ios::in) << "x";
  }
  testing_support::Program worker(scratch.path(), {"worker", "--data", At("data")});
  json job;
  for (std::string state = "queued"; state == "queued" || state == "running"; state = job["state"])
    job = RunJson({"jobs", sent["job"], "--server", server.url()});
  worker.Signal(SIGTERM);
  EXPECT_EQ(job["state"], "failed");
  EXPECT_THAT(job["error"]["detail"].get<std::string>(),
              HasSubstr("Mueller_1970.nii.gz is damaged on the service's disk"));
  const std::string log = worker.Wait().err;
  EXPECT_THAT(log, HasSubstr(R"("stage":"load")"));
  EXPECT_THAT(log, testing::Not(HasSubstr("Mueller"))) << "the log names no scan";
}

TEST_F(Operations, AWorkerOutlivesWhoReadsItsLog) {
  const Served server(scratch.path() / "data", {"--workers", "0"});
  const std::string worker = "{ timeout 3 " KVX_PROGRAM " worker --data " + At("data") + "; echo $? >" +
                             At("code") + "; } 2>&1 | true";
  ASSERT_EQ(std::system(worker.c_str()), 0);
  EXPECT_EQ(Content(At("code")), "124\n") << "stopped by its time";
}

TEST_F(Operations, ABackupThatRunsOutOfRoomLeavesTheOneBefore) {
  std::filesystem::create_directory(scratch.path() / "study");
  const auto study = testing_support::WriteHingeStudy(scratch.path() / "study");
  const Served server(scratch.path() / "data", {"--workers", "0"});
  const std::vector<std::string> submit{"submit", study.string(), "--server", server.url(), "--quiet"};
  const std::vector<std::string> backup{"backup", "--data", At("data"), "--out", At("copy")};
  ASSERT_EQ(Run(submit).code, 0);
  ASSERT_EQ(Run(backup).code, 0);
  WriteVolume(scratch.path() / "study" / "large.nii", LinearRamp{}.On(ObliqueGrid({128, 128, 128})),
              ScalarType::kInt16);
  json more = json::parse(Content(study));
  more["scans"].push_back({{"name", "large"}, {"volume", "large.nii"}});
  std::ofstream(study) << more;
  ASSERT_EQ(Run(submit).code, 0);
  {
    const testing_support::SmallDisk disk(2 << 20);  // the database has room, the scan of 4 MiB has not
    EXPECT_EQ(Run(backup).code, 4);
  }
  EXPECT_EQ(Run({"restore", "--from", At("copy"), "--data", At("before")}).code, 0);
  EXPECT_EQ(Run(backup).code, 0);
  EXPECT_EQ(Run({"restore", "--from", At("copy"), "--data", At("after")}).code, 0);
  for (const auto& file : std::filesystem::recursive_directory_iterator(scratch.path() / "copy"))
    EXPECT_NE(file.path().extension(), ".copying");
}

TEST_F(Operations, MadeUpRequestsFindNoFault) {
  if (std::system("/usr/bin/python3 -c 'import hypothesis, jsonschema' 2>/dev/null") != 0) {
    GTEST_SKIP() << "python3-hypothesis and python3-jsonschema are not installed";
  }
  const Served server(scratch.path() / "data", {"--log", "error"});
  const std::string command = "/usr/bin/python3 " KVX_SOURCE_DIR "/tests/server/fuzz_api.py " + server.url() +
                              " --examples 8 --seed 7 >" + At("fuzz.out") + " 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << Content(At("fuzz.out"));
}

TEST_F(Operations, TheSmokeTestPasses) {
  const Served server(scratch.path() / "data");
  const std::string command =
      KVX_SOURCE_DIR "/deploy/smoke.sh " + server.url() + " >" + At("smoke.out") + " 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << Content(At("smoke.out"));
}

TEST_F(Operations, EveryCommandOfTheApiPageWorks) {
  std::filesystem::create_directory(scratch.path() / "study");
  testing_support::WriteHingeStudy(scratch.path() / "study");
  const Served server(scratch.path() / "data");
  const std::string command = "/usr/bin/python3 " KVX_SOURCE_DIR "/tests/cli/api_walk.py " + server.url() +
                              " " + At("study") + " >" + At("walk.out") + " 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << Content(At("walk.out"));
}

TEST_F(Operations, TheDocumentOfTheApiIsClean) {
  const std::string linter = KVX_SOURCE_DIR "/third_party/api-page/node_modules/.bin/redocly";
  if (!std::filesystem::exists(linter)) GTEST_SKIP() << "@redocly/cli is not installed";
  const std::string command = "REDOCLY_TELEMETRY=off REDOCLY_SUPPRESS_UPDATE_NOTICE=true " + linter +
                              " lint " KVX_SOURCE_DIR "/api/schema/openapi.json --config " KVX_SOURCE_DIR
                              "/deploy/api-page/redocly.yaml --max-problems 20 >" +
                              At("lint.out") + " 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << Content(At("lint.out"));
}

}  // namespace
}  // namespace kvx
