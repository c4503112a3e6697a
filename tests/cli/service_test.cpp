// The service as programs: serve, submit, jobs, fetch; and a build that is killed with the whole server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "pipeline/io/volume_file.h"
#include "tests/support/hinge_study.h"
#include "tests/support/program_test.h"
#include "tests/support/served.h"
#include "tests/support/unzipped.h"

namespace kvx {
namespace {

using nlohmann::json;
using testing_support::Content;
using testing_support::Ended;
using testing_support::Program;
using testing_support::ProgramTest;
using testing_support::ScratchFolder;
using testing_support::Served;
using testing_support::Unzipped;

namespace fs = std::filesystem;
constexpr auto kPause = std::chrono::milliseconds(10);
constexpr int kPatience = 30'000;  // pauses: five minutes on a busy machine

class ServiceProgram : public ProgramTest {
 protected:
  // Written once, by the first test that needs it.
  static std::string Study() {
    static const ScratchFolder folder;
    static const fs::path study = testing_support::WriteHingeStudy(folder.path());
    return study.string();
  }
  json Submit(const Served& server, bool wait) const {
    std::vector<std::string> words{"submit", Study(), "--server", server.url(), "--quiet"};
    if (wait) words.push_back("--wait");
    return RunJson(words);
  }
  json Job(const Served& server, const std::string& id) const {
    return RunJson({"jobs", id, "--server", server.url()});
  }
  json WaitFor(const Served& server, const std::string& id) const {
    for (int i = 0; i < kPatience / 10; ++i) {
      const json job = Job(server, id);
      if (job["state"] != "queued" && job["state"] != "running") return job;
      std::this_thread::sleep_for(10 * kPause);
    }
    ADD_FAILURE() << "the job does not end";
    return {};
  }
};

std::map<std::string, fs::file_time_type> Artefacts(const fs::path& data) {
  std::map<std::string, fs::file_time_type> files;
  for (const auto& entry : fs::recursive_directory_iterator(data / "artifacts")) {
    if (entry.path().extension() == ".kva") files[entry.path().string()] = entry.last_write_time();
  }
  return files;
}

TEST_F(ServiceProgram, AKilledServerGoesOnFromTheLastFinishedStage) {
  const fs::path data = scratch.path() / "killed";
  auto first = std::make_unique<Served>(data);
  const std::string id = Submit(*first, false)["job"];
  for (int i = 0; i < kPatience && Artefacts(data).size() < 3; ++i) std::this_thread::sleep_for(kPause);
  first->Stop(SIGKILL);
  first.reset();
  const auto before = Artefacts(data);
  ASSERT_GE(before.size(), 3u);

  Served second(data);
  const json job = WaitFor(second, id);
  ASSERT_EQ(job["state"], "succeeded") << job;
  EXPECT_EQ(job["attempt"], 2) << "the server was killed in the middle of the build";
  const auto after = Artefacts(data);
  for (const auto& [file, time] : before)
    EXPECT_EQ(after.at(file), time) << "a finished stage was done again";
  EXPECT_GT(after.size(), before.size());

  const Served undisturbed(scratch.path() / "undisturbed");
  const json other = Submit(undisturbed, true);
  EXPECT_EQ(other["result"]["digest"], job["result"]["digest"]);
}

TEST_F(ServiceProgram, SubmitsBuildsAndFetches) {
  Served server(scratch.path() / "data");
  const json submitted = Submit(server, true);
  EXPECT_EQ(submitted["state"], "succeeded");
  const std::string model = submitted["id"];
  const Ended fetched =
      Run({"fetch", model, "--server", server.url(), "--scan", "pose01", "--out", At("a.nii.gz"), "--quiet"});
  ASSERT_EQ(fetched.code, 0) << fetched.err;
  EXPECT_EQ(fetched.err, "") << "a scan that belongs is no guess";
  EXPECT_GT(ReadScan(At("a.nii.gz")).volume.values.size(), 0u);
  const Ended far = Run({"fetch", model, "--server", server.url(), "--joint", "lower.flexion=170", "--level",
                         "2", "--out", At("far.nrrd"), "--quiet", "--json"});
  ASSERT_EQ(far.code, 0) << far.err;
  EXPECT_NE(far.err.find("a guess"), std::string::npos) << far.err;
  EXPECT_GT(json::parse(far.out)["extrapolation"], 1);
  const auto fetch = [&](std::vector<std::string> more, const std::string& name) {
    std::vector<std::string> words{"fetch", model, "--server", server.url(), "--scan", "pose01", "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    words.insert(words.end(), {"--out", At(name)});
    EXPECT_EQ(Run(words).code, 0) << name;
    return At(name);
  };
  const LabelMap labels = ReadLabels(fetch({"--label"}, "l.nrrd"));
  EXPECT_EQ(std::set(labels.values.begin(), labels.values.end()), (std::set<uint16_t>{0, 1, 2}));
  EXPECT_EQ(ReadScan(Unzipped(fetch({"--modality", "CT"}, "series.zip"))).modality, "CT");
  const LabelMap segments = ReadLabels(fetch({"--label"}, "bones.dcm"));
  for (const int label : {1, 2})
    EXPECT_EQ(std::ranges::count(segments.values, label), std::ranges::count(labels.values, label)) << label;
  EXPECT_EQ(
      Run({"fetch", "mdl_none", "--server", server.url(), "--scan", "pose01", "--out", At("b.nii.gz")}).code,
      5);
  EXPECT_FALSE(fs::exists(At("b.nii.gz")));
  EXPECT_EQ(
      Run({"fetch", model, "--server", server.url(), "--joint", "nobody.flexion=1", "--out", At("b.nii.gz")})
          .code,
      5);
  EXPECT_EQ(RunJson({"jobs", "--server", server.url()})["items"][0]["id"], submitted["job"]);
  EXPECT_EQ(server.Stop(SIGTERM).code, 0) << "a stop on request is no failure";
}

TEST_F(ServiceProgram, AFolderOfMasksIsSentAsOneLabelMap) {
  const Served server(scratch.path() / "data");
  json study = json::parse(std::ifstream(Study()));
  const fs::path folder = fs::path(Study()).parent_path(), masks = folder / "masks";
  fs::create_directory(masks);
  const LabelMap labels = ReadLabels(folder / study["bones"]["labels"]);
  for (json& bone : study["bones"]["list"]) {
    LabelMap mask = labels;
    for (uint16_t& value : mask.values) value = value == bone["label"];
    WriteLabels(masks / (bone["name"].get<std::string>() + ".nii.gz"), mask);
    bone.erase("label");
  }
  study["bones"]["labels"] = "masks";
  std::ofstream(folder / "masks.json") << study;
  const Ended ended = Run(
      {"submit", (folder / "masks.json").string(), Study(), "--server", server.url(), "--wait", "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const json studies = json::parse(ended.out)["studies"];
  const auto posed = [&](const json& model) {
    const Ended fetched = Run({"fetch", model["id"], "--server", server.url(), "--scan", "pose01", "--label",
                               "--out", At("labels.nrrd"), "--quiet"});
    EXPECT_EQ(fetched.code, 0) << fetched.err;
    return ReadLabels(At("labels.nrrd")).values;
  };
  EXPECT_EQ(posed(studies[0]), posed(studies[1]));
}

TEST_F(ServiceProgram, ManyStudiesAreOneBatchAndTheirBytesGoOnce) {
  const Served server(scratch.path() / "data");
  const fs::path broken = scratch.path() / "broken.json";
  std::ofstream(broken) << "{}";
  const Ended ended =
      Run({"submit", Study(), broken.string(), Study(), "--server", server.url(), "--wait", "--json"});
  EXPECT_EQ(ended.code, 4) << "one of them has no model";
  const json all = json::parse(ended.out, nullptr, false);
  ASSERT_EQ(all["studies"].size(), 3u) << ended.out << ended.err;
  EXPECT_TRUE(all["batch"].get<std::string>().starts_with("bat_"));
  EXPECT_EQ(all["studies"][0]["state"], "succeeded");
  EXPECT_EQ(all["studies"][1]["state"], "failed");
  EXPECT_FALSE(all["studies"][1]["error"]["detail"].get<std::string>().empty());
  EXPECT_EQ(all["studies"][2]["result"]["digest"], all["studies"][0]["result"]["digest"]);
  size_t blobs = 0;
  for (const auto& entry : fs::recursive_directory_iterator(scratch.path() / "data" / "blobs"))
    blobs += entry.is_regular_file();
  EXPECT_EQ(blobs, 4u) << "three scans and the bones";
  EXPECT_THAT(ended.err, testing::HasSubstr("uploading"));
  EXPECT_EQ(Run({"cancel", all["batch"], "--server", server.url()}).code, 4) << "all have ended";
}

// A label that the map does not hold is found by the service: when the models are asked for.
TEST_F(ServiceProgram, AStudyThatTheServiceRefusesDoesNotStopTheOthers) {
  const Served server(scratch.path() / "data");
  const fs::path folder = fs::path(Study()).parent_path(), refused = folder / "refused.json";
  json study = json::parse(std::ifstream(Study()));
  study["bones"]["list"][0]["label"] = 9;
  std::ofstream(refused) << study;
  const fs::path unread = scratch.path() / "unread.json";
  std::ofstream(unread) << "{}";
  const Ended ended = Run(
      {"submit", unread.string(), Study(), refused.string(), "--server", server.url(), "--wait", "--json"});
  EXPECT_EQ(ended.code, 4);
  const json studies = json::parse(ended.out)["studies"];
  EXPECT_EQ(studies[0]["state"], "failed");
  EXPECT_EQ(studies[1]["state"], "succeeded");
  EXPECT_EQ(studies[2]["state"], "failed");
  const std::string why = studies[2]["error"]["detail"];
  EXPECT_THAT(why, testing::HasSubstr("the label 9"));
  EXPECT_THAT(why, testing::Not(testing::HasSubstr("models["))) << "a number that this command made";
}

TEST_F(ServiceProgram, StudiesWhosePathsAreNotUtf8AreToldAsWell) {
  const Served server(scratch.path() / "data", {"--workers", "0"});
  const fs::path latin = scratch.path() / "st\xe9";
  fs::copy(fs::path(Study()).parent_path(), latin);
  const std::string study = (latin / "study.json").string();
  const json alone = RunJson({"submit", study, "--server", server.url(), "--json"});
  const json two = RunJson({"submit", study, Study(), "--server", server.url(), "--json"});
  for (const json& told : {alone, two["studies"][0]}) {
    EXPECT_EQ(told["state"], "queued");
    EXPECT_THAT(told["study"].get<std::string>(), testing::HasSubstr("st\xef\xbf\xbd/study.json"));
  }
}

// The second asks for nothing but what did not come of the first.
TEST_F(ServiceProgram, OnlyWhatWasCancelledIsAskedForAnew) {
  const Served server(scratch.path() / "data", {"--workers", "0"});
  const fs::path other = fs::path(Study()).parent_path() / "other.json";
  json study = json::parse(std::ifstream(Study()));
  study["name"] = "other";
  std::ofstream(other) << study;
  const std::vector<std::string> words{"submit", Study(), other.string(), "--server", server.url(), "--json"};
  const json first = RunJson(words)["studies"];
  const Ended cancelled = Run({"cancel", "job_none", first[1]["job"], "--server", server.url()});
  EXPECT_EQ(cancelled.code, 4) << "one of them is not there";
  EXPECT_EQ(Job(server, first[1]["job"])["state"], "cancelled") << cancelled.out << cancelled.err;
  const json second = RunJson(words)["studies"];
  EXPECT_EQ(second[0]["id"], first[0]["id"]);
  EXPECT_EQ(second[0]["job"], first[0]["job"]);
  EXPECT_NE(second[1]["id"], first[1]["id"]);
  EXPECT_EQ(second[1]["state"], "queued");
  EXPECT_EQ(RunJson(words)["studies"][1]["id"], second[1]["id"]);
}

// One study of three cannot be read at first. Once it is mended the same command makes its model alone.
TEST_F(ServiceProgram, AMendedStudyLeavesTheOthersAsTheyAre) {
  const Served server(scratch.path() / "data", {"--workers", "0"});
  const fs::path folder = fs::path(Study()).parent_path(), other = folder / "other.json",
                 mended = folder / "mended.json";
  json study = json::parse(std::ifstream(Study()));
  study["name"] = "other";
  std::ofstream(other) << study;
  std::ofstream(mended) << "{}";
  const std::vector<std::string> words{"submit",   Study(),      mended.string(), other.string(),
                                       "--server", server.url(), "--json"};
  const json alone = Submit(server, false);
  const json first = json::parse(Run(words).out)["studies"];
  EXPECT_EQ(first[0]["id"], alone["id"]) << "a study that was sent by itself is known among others";
  EXPECT_EQ(first[1]["state"], "failed");
  study["name"] = "mended";
  std::ofstream(mended) << study;
  const json second = RunJson(words)["studies"];
  for (const size_t i : {0, 2}) {
    EXPECT_EQ(second[i]["id"], first[i]["id"]);
    EXPECT_EQ(second[i]["job"], first[i]["job"]);
  }
  EXPECT_EQ(second[1]["state"], "queued");
  EXPECT_EQ(RunJson({"jobs", "--server", server.url()})["items"].size(), 3u);
}

TEST_F(ServiceProgram, WhatABuildWarnsOfIsTold) {
  const Served server(scratch.path() / "data");
  const fs::path twice = fs::path(Study()).parent_path() / "twice.json";
  json study = json::parse(std::ifstream(Study()));
  study["scans"].push_back(study["scans"].back());
  study["scans"].back()["name"] = "again";
  study["bones"]["list"][0]["parnet"] = "lower";
  std::ofstream(twice) << study;
  const Ended ended = Run({"submit", twice.string(), Study(), "--server", server.url(), "--wait", "--json"});
  const json told = json::parse(ended.out)["studies"][0];
  const std::string warning = told["result"]["warnings"].at(0);
  EXPECT_THAT(warning, testing::HasSubstr("'again'"));
  EXPECT_THAT(ended.err, testing::HasSubstr("kinevox: warning: twice.json: " + warning));
  EXPECT_THAT(ended.err, testing::ContainsRegex("warning: twice.json: nothing .* bones.list.0..parnet"));
  EXPECT_THAT(Run({"jobs", told["job"], "--server", server.url()}).err,
              testing::HasSubstr("kinevox: warning: " + warning));
  const std::string list = Run({"jobs", "--server", server.url()}).out;
  const size_t line = list.find(told["job"].get<std::string>());
  EXPECT_TRUE(list.substr(line, list.find('\n', line) - line).ends_with("1 warning")) << list;
}

TEST_F(ServiceProgram, SubmitGoesOnAfterTheServiceWasAway) {
  auto first = std::make_unique<Served>(scratch.path() / "data");
  const std::string address = first->url().substr(7);
  Program submit(scratch.path(), {"submit", Study(), "--server", first->url(), "--wait", "--json"});
  while (submit.Running() &&
         json::parse(Run({"jobs", "--server", first->url(), "--json"}).out)["items"].empty()) {
  }
  first->Stop(SIGKILL);
  first.reset();
  const Served second(scratch.path() / "data", {}, address);
  ASSERT_EQ(second.url(), "http://" + address);
  const Ended ended = submit.Wait();
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(json::parse(ended.out, nullptr, false)["state"], "succeeded");
}

TEST_F(ServiceProgram, TheSameCommandAgainFindsWhatItAskedFor) {
  const Served server(scratch.path() / "data");
  const json first = Submit(server, false), second = Submit(server, true);
  EXPECT_EQ(second["id"], first["id"]);
  EXPECT_EQ(second["job"], first["job"]);
  EXPECT_EQ(second["state"], "succeeded");
  const json third = Submit(server, false);
  EXPECT_EQ(third["state"], "succeeded") << "as it is now, not as it was answered first";
  const std::vector<std::string> again{"submit", Study(), "--server", server.url(), "--quiet", "--again"};
  const json anew = RunJson(again);
  EXPECT_NE(anew["id"], first["id"]);
  EXPECT_EQ(RunJson({"jobs", "--server", server.url()})["items"].size(), 2u);
}

TEST_F(ServiceProgram, AJobThatWasCancelledOrRemovedIsAskedForAnew) {
  Served server(scratch.path() / "data", {"--workers", "0"});
  const json first = Submit(server, false);
  EXPECT_EQ(Submit(server, false)["job"], first["job"]);
  ASSERT_EQ(Run({"cancel", first["job"], "--server", server.url()}).code, 0);
  const json second = Submit(server, false);
  EXPECT_NE(second["job"], first["job"]);
  EXPECT_EQ(Submit(server, false)["job"], second["job"]) << "that one is followed from now on";
}

TEST_F(ServiceProgram, AnInterruptedSubmitSaysThatTheJobGoesOn) {
  const Served server(scratch.path() / "data", {"--workers", "0"});
  Program submit(scratch.path(), {"submit", Study(), "--server", server.url(), "--wait", "--json"});
  json jobs;
  while (submit.Running() && jobs.empty()) jobs = RunJson({"jobs", "--server", server.url()})["items"];
  std::this_thread::sleep_for(50 * kPause);  // until it waits
  submit.Signal(SIGINT);
  const Ended ended = submit.Wait();
  EXPECT_EQ(ended.code, 130);
  const std::string job = jobs[0]["id"];
  EXPECT_THAT(ended.err, testing::HasSubstr("kinevox jobs " + job));
  EXPECT_THAT(ended.err, testing::HasSubstr("kinevox cancel " + job));
}

TEST_F(ServiceProgram, CompletionKnowsEverySubcommand) {
  const Ended bash = Run({"completion", "bash"});
  ASSERT_EQ(bash.code, 0);
  for (const char* word : {"submit", "worker", "cancel", "--server", "--lease-seconds"}) {
    EXPECT_THAT(bash.out, testing::HasSubstr(word));
  }
  EXPECT_THAT(bash.out, testing::Not(testing::HasSubstr("inspect-upload")));
  const fs::path script = scratch.path() / "completion";
  std::ofstream lines(script);
  lines << bash.out;
  for (const char* words :
       {"sub", "submit --ser", "pose m --jo", "map-points m --sc", "keys ''", "audit ''", "keys add --sco",
        "keys add --scope ''", "phantom ''", "phantom hand --scale ''", "build --method = a",
        "pose --mode =", "completion ''", "serve --log ''", "pose m --out ''", "build keys"}) {
    lines << "COMP_WORDS=(kinevox " << words
          << "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _kinevox; echo \"${COMPREPLY[@]}\"\n";
  }
  lines.close();
  const fs::path out = scratch.path() / "completed";
  ASSERT_EQ(std::system(("bash " + script.string() + " > " + out.string()).c_str()), 0);
  EXPECT_EQ(Content(out),
            "submit\n--server\n--joint\n--scan\nadd list revoke\nverify list\n--scope\nread write admin\n"
            "hand knee\nfull half\nadaptive\nevd vbd elastic\nbash zsh\ninfo warn error off\n\n\n");
  EXPECT_THAT(Run({"completion", "zsh"}).out, testing::HasSubstr("bashcompinit"));
  EXPECT_EQ(Run({"completion", "fish"}).code, 2);
}

TEST_F(ServiceProgram, RefusesWhatItCannotDoSafely) {
  const Ended open = Run({"serve", "--data", At("data"), "--listen", "0.0.0.0:0"});
  EXPECT_EQ(open.code, 3);
  EXPECT_EQ(Run({"serve", "--data", At("data"), "--listen", "0.0.0.0:0", "--set", "auth.api_keys=true"}).code,
            3)
      << "without TLS";
  EXPECT_THAT(open.err, testing::HasSubstr("without authentication"));
  const Served server(scratch.path() / "data");
  EXPECT_EQ(Run({"serve", "--data", At("data"), "--listen", "127.0.0.1:0"}).code, 4)
      << "the data folder is in use";
  const std::string port = server.url().substr(server.url().rfind(':') + 1);
  EXPECT_EQ(Run({"serve", "--data", At("other"), "--listen", "127.0.0.1:" + port}).code, 4)
      << "the port is taken";
  EXPECT_EQ(Run({"jobs", "--server", "http://127.0.0.1:1"}).code, 4);
  EXPECT_EQ(Run({"jobs", "--server", "nonsense"}).code, 2);
}

}  // namespace
}  // namespace kvx
