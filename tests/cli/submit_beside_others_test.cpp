// Several studies of which one fares badly, and a service that takes no more: what is told of each.
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "pipeline/io/volume_file.h"
#include "tests/support/hinge_study.h"
#include "tests/support/program_test.h"
#include "tests/support/scripted_service.h"

namespace kvx {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;
using testing_support::Content;
using testing_support::Ended;
using testing_support::ScriptedService;
using Request = httplib::Request;
using Response = httplib::Response;

class SubmitBesideOthers : public testing_support::ProgramTest {
 protected:
  // Named after its folder; the bytes of the scans are the same.
  std::string Study(const std::string& name) const {
    std::filesystem::create_directories(scratch.path() / name);
    const std::filesystem::path file = testing_support::WriteHingeStudy(scratch.path() / name);
    json study = json::parse(std::ifstream(file));
    study["name"] = name;
    std::ofstream(file) << study;
    return file.string();
  }
  std::vector<std::string> Words(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"submit", first, second, "--server", service.url(), "--json", "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  json StudiesOf(const Ended& ended) const {
    const json told = json::parse(ended.out, nullptr, false);
    EXPECT_TRUE(told.is_object() && told.contains("studies")) << ended.out << ended.err;
    return told.is_object() ? told.value("studies", json::array({json(), json()})) : json();
  }
  static std::string Why(const json& study) {
    return study.value("/error/detail"_json_pointer, std::string("nothing"));
  }
  const std::string first = Study("first"), second = Study("second");
  ScriptedService service;
};

// Root reads every file, but for those capabilities.
TEST_F(SubmitBesideOthers, AScanThatMayNotBeReadIsTheFaultOfItsStudyAlone) {
  constexpr char kWithout[] = "setpriv --bounding-set=-dac_override,-dac_read_search ";
  const std::string as_anybody = ::getuid() == 0 ? kWithout : "";
  if (std::system((as_anybody + "true").c_str()) != 0) GTEST_SKIP() << "nobody can be denied a file here";
  service.Listen();
  const std::filesystem::path scan = std::filesystem::path(first).parent_path() / "pose01.nii.gz";
  std::filesystem::permissions(scan, std::filesystem::perms::none);
  std::string command = as_anybody + KVX_PROGRAM;
  for (const std::string& word : Words()) command += " " + word;
  const int status = std::system((command + " > " + At("out") + " 2> " + At("err")).c_str());
  EXPECT_EQ(WEXITSTATUS(status), 4);
  const json studies = StudiesOf({WEXITSTATUS(status), Content(At("out")), Content(At("err"))});
  EXPECT_EQ(studies[0]["state"], "failed");
  EXPECT_THAT(Why(studies[0]), HasSubstr("scan 'pose01': a scan file may not be read"));
  EXPECT_EQ(studies[1]["state"], "succeeded");
}

TEST_F(SubmitBesideOthers, AStudyThatCannotBePackedNamesThePlaceAndLeavesTheOthers) {
  service.Listen();
  const std::filesystem::path folder = std::filesystem::path(first).parent_path();
  const Scan scan = ReadScan(folder / "pose01.nii.gz");
  WriteVolume(folder / "pose01.mhd", scan.volume, scan.stored_as);
  json study = json::parse(std::ifstream(first));
  study["scans"][1]["volume"] = "pose01.mhd";
  std::ofstream(first) << study;
  setenv("TMPDIR", At("nowhere").c_str(), 1);
  const Ended ended = Run(Words());
  unsetenv("TMPDIR");
  EXPECT_EQ(ended.code, 4);
  const json studies = StudiesOf(ended);
  EXPECT_THAT(Why(studies[0]), HasSubstr("scan 'pose01': its files cannot be packed"));
  EXPECT_THAT(Why(studies[0]), HasSubstr("TMPDIR"));
  EXPECT_EQ(studies[1]["state"], "succeeded");
}

TEST_F(SubmitBesideOthers, AConflictIsTheFaultOfItsStudyAlone) {
  service.put_scan = [](const Request& q, Response& r) {
    if (q.path.find("sub_1") != q.path.npos) return ScriptedService::Say(r, 409, {{"detail", "has it"}});
    ScriptedService::Say(r, 201, {{"id", "scn_1"}});
  };
  service.Listen();
  const Ended ended = Run(Words());
  EXPECT_EQ(ended.code, 4);
  const json studies = StudiesOf(ended);
  EXPECT_THAT(Why(studies[0]), HasSubstr("has it"));
  EXPECT_EQ(studies[1]["state"], "succeeded");
}

// A full disk takes no batch either; a key can be revoked just then.
TEST_F(SubmitBesideOthers, WhatHasArrivedIsToldWhereTheServiceTakesNoModels) {
  int status = 507;
  service.post_batch = [&](const Request&, Response& r) {
    r.set_header("Retry-After", "50000");
    ScriptedService::Say(r, status, {{"detail", "so it is"}});
  };
  service.Listen();
  for (const auto& [answer, code] : {std::pair{507, 4}, {401, 6}, {429, 6}}) {
    status = answer;
    const Ended ended = Run(Words({"--wait"}));
    EXPECT_EQ(ended.code, code) << ended.err;
    EXPECT_THAT(ended.err, HasSubstr("so it is"));
    const json studies = StudiesOf(ended);
    for (const size_t i : {0, 1}) {
      EXPECT_EQ(studies[i]["state"], "failed");
      EXPECT_THAT(Why(studies[i]), HasSubstr("its files have arrived"));
    }
  }
}

TEST_F(SubmitBesideOthers, AJobThatIsGoneDoesNotHideTheOthers) {
  service.get_job = [](const Request& q, Response& r) {
    const std::string id = q.matches[1];
    if (id == "job_1") return ScriptedService::Say(r, 404, {{"detail", "no such job"}});
    ScriptedService::Say(r, 200, {{"id", id}, {"state", "succeeded"}});
  };
  service.Listen();
  const Ended ended = Run(Words({"--wait"}));
  EXPECT_EQ(ended.code, 4) << ended.err;
  const json studies = StudiesOf(ended);
  EXPECT_EQ(studies[0]["state"], "failed");
  EXPECT_THAT(Why(studies[0]), HasSubstr("gone from the service"));
  EXPECT_EQ(studies[1]["state"], "succeeded");
}

// Their label maps cross each other on the way; the service would build a model of each.
TEST_F(SubmitBesideOthers, TheSameCommandTwiceAtOnceAsksForOneModel) {
  std::atomic<int> looks = 0;
  service.get_bones = [&](const Request&, Response& r) {
    if (++looks == 1) return ScriptedService::SayBones(r, {});
    ScriptedService::SayBones(r, {"bon_sent", "bon_of_the_other"});
  };
  service.Listen();
  const Ended ended = Run({"submit", first, "--server", service.url(), "--quiet"});
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(service.asked["bones"]["id"], "bon_of_the_other");
}

TEST_F(SubmitBesideOthers, WhyNoJobIsBegunIsTold) {
  std::atomic<int> looks = 0;
  service.get_job = [&](const Request& q, Response& r) {
    const bool ended = ++looks > 6;
    ScriptedService::Say(
        r, 200,
        {{"id", q.matches[1].str()}, {"state", ended ? "succeeded" : "queued"}, {"progress", ended ? 1 : 0}});
  };
  service.get_ready = [](const Request&, Response& r) {
    ScriptedService::Say(r, 503, {{"detail", "the disk is nearly full; make room"}});
  };
  service.Listen();
  const Ended ended = Run({"submit", first, second, "--server", service.url(), "--wait"});
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_THAT(ended.err, HasSubstr("first    0 %  queued: the disk is nearly full\n"));
  EXPECT_THAT(ended.err, Not(HasSubstr("second    0 %  queued: ")));
}

TEST_F(SubmitBesideOthers, ATableThatCannotBeWrittenIsToldBesideStudiesThatFailed) {
  service.Listen();
  const std::string words = " submit " + first + " " + At("none.json") + " --quiet --server " + service.url();
  const int status = std::system((KVX_PROGRAM + words + " > /dev/full 2> " + At("err")).c_str());
  EXPECT_EQ(WEXITSTATUS(status), 4);
  EXPECT_THAT(Content(At("err")), HasSubstr("cannot be written to stdout"));
}

TEST_F(SubmitBesideOthers, StudiesThatAreAlikeAreToldSo) {
  service.Listen();
  const std::string copy = Study("copy");
  std::filesystem::copy_file(first, copy, std::filesystem::copy_options::overwrite_existing);
  const Ended ended = Run({"submit", first, second, copy, "--server", service.url(), "--quiet"});
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(ended.err,
            "kinevox: warning: copy: has the same scans and bones as first; each gets a model of its own\n");
}

TEST_F(SubmitBesideOthers, AModelOfThenIsToldWithWhatItsBuildSaid) {
  service.post_batch = [](const Request&, Response& r) {
    json batch = ScriptedService::BatchOf(2, "succeeded");
    for (json& model : batch["models"]) {
      model["earlier"] = true;
      model["result"] = {{"digest", "of " + model["id"].get<std::string>()},
                         {"warnings", {"a bone is doubtful"}}};
    }
    ScriptedService::Say(r, 202, batch);
  };
  service.Listen();
  const Ended ended = Run(Words({"--wait"}));
  EXPECT_EQ(ended.code, 0) << ended.err;
  const json studies = StudiesOf(ended);
  EXPECT_EQ(studies[0].value("/result/digest"_json_pointer, ""), "of mdl_1");
  EXPECT_EQ(studies[1].value("/result/digest"_json_pointer, ""), "of mdl_2");
  EXPECT_THAT(ended.err, HasSubstr("warning: first: a bone is doubtful"));
  EXPECT_THAT(ended.err, HasSubstr("warning: second: a bone is doubtful"));
}

TEST_F(SubmitBesideOthers, OptionsOfThePapersMethodGoWithItAlone) {
  service.Listen();
  const std::vector<std::string> one{"submit", first, "--server", service.url(), "--quiet"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), one.begin(), one.end());
    return Run(more);
  };
  for (const char* option : {"--max-blocks", "--max-seconds", "--seed"}) {
    const Ended refused = with({option, "7"});
    EXPECT_EQ(refused.code, 2);
    EXPECT_THAT(refused.err, HasSubstr("belongs to --method paper"));
    EXPECT_EQ(with({option, "7", "--method", "adaptive"}).code, 2);
  }
  EXPECT_TRUE(service.asked.is_null()) << "before anything is sent";
  ASSERT_EQ(with({"--method", "paper", "--max-blocks", "3", "--seed", "5"}).code, 0);
  EXPECT_EQ(service.asked["options"], (json{{"method", "paper"}, {"max_blocks", 3}, {"seed", 5}}));
}

}  // namespace
}  // namespace kvx
