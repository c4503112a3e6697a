// Ctrl-C at a client of the service: while it waits for an answer, and what it says of what goes on.
#include <gmock/gmock.h>
#include <signal.h>

#include <atomic>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/support/hinge_study.h"
#include "tests/support/program_test.h"
#include "tests/support/scripted_service.h"

namespace kvx {
namespace {

using testing::HasSubstr;
using testing_support::Ended;
using testing_support::Program;

constexpr auto kPause = std::chrono::milliseconds(10);

// Answers nobody until it ends, or five minutes are over.
class Silent {
 public:
  Silent() {
    const auto hold = [this](const httplib::Request&, httplib::Response&) {
      asked = true;
      for (int i = 0; i < 30'000 && !ended_; ++i) std::this_thread::sleep_for(kPause);
      answered = true;
    };
    server_.http.Get(".*", hold);
    server_.http.Post(".*", hold);
    server_.Listen();
  }
  ~Silent() { ended_ = true; }
  std::string url() const { return server_.url(); }
  std::atomic<bool> asked = false, answered = false;

 private:
  std::atomic<bool> ended_ = false;
  testing_support::ListeningServer server_;
};

class InterruptedClient : public testing_support::ProgramTest {
 protected:
  Ended Interrupted(const std::vector<std::string>& words, const std::atomic<bool>& when) const {
    Program program(scratch.path(), words);
    while (program.Running() && !when) std::this_thread::sleep_for(kPause);
    program.Signal(SIGINT);
    return program.Wait();
  }
};

TEST_F(InterruptedClient, IsHeardWhileTheServiceIsSilent) {
  const std::string study = testing_support::WriteHingeStudy(scratch.path()).string();
  std::filesystem::create_directory(At("fetched"));
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
           {"submit", study}, {"fetch", "mdl_1", "--scan", "pose01", "--out", At("fetched/a.nii.gz")}}) {
    const Silent service;
    std::vector<std::string> all = words;
    all.insert(all.end(), {"--server", service.url(), "--quiet"});
    const Ended ended = Interrupted(all, service.asked);
    EXPECT_EQ(ended.code, 130) << words[0] << ended.err;
    EXPECT_FALSE(service.answered) << words[0];
  }
  EXPECT_TRUE(std::filesystem::is_empty(At("fetched")));
}

// Built once more, it is not what the first command made.
TEST_F(InterruptedClient, ASubmitThatBuildsAnewDoesNotSayThatItWaitsAgain) {
  const std::string study = testing_support::WriteHingeStudy(scratch.path()).string();
  testing_support::ScriptedService service;
  std::atomic<bool> looked = false;
  service.get_job = [&](const httplib::Request& q, httplib::Response& r) {
    looked = true;
    testing_support::ScriptedService::Say(
        r, 200, {{"id", q.matches[1].str()}, {"state", "queued"}, {"created", "2026"}, {"progress", 0}});
  };
  service.Listen();
  for (const bool again : {false, true}) {
    looked = false;
    std::vector<std::string> words{"submit", study, "--server", service.url(), "--wait"};
    if (again) words.push_back("--again");
    Program submit(scratch.path(), words);
    while (submit.Running() && !looked) std::this_thread::sleep_for(kPause);
    std::this_thread::sleep_for(50 * kPause);  // until it waits
    submit.Signal(SIGINT);
    const Ended ended = submit.Wait();
    EXPECT_EQ(ended.code, 130) << ended.err;
    EXPECT_THAT(ended.err, HasSubstr("kinevox jobs job_1"));
    const bool waits = ended.err.find("the same command waits for it again") != ended.err.npos;
    EXPECT_EQ(waits, !again) << ended.err;
  }
}

// The job is there, but whether it is this command's own is not known yet.
TEST_F(InterruptedClient, ASubmitThatHasAskedSaysWhereItsJobIsSeen) {
  const std::string study = testing_support::WriteHingeStudy(scratch.path()).string();
  testing_support::ScriptedService service;
  std::atomic<bool> looked = false, ended = false;
  service.get_job = [&](const httplib::Request&, httplib::Response&) {
    looked = true;
    for (int i = 0; i < 3000 && !ended; ++i) std::this_thread::sleep_for(kPause);
  };
  service.Listen();
  const Ended submit = Interrupted({"submit", study, "--server", service.url(), "--quiet"}, looked);
  ended = true;
  EXPECT_EQ(submit.code, 130) << submit.err;
  EXPECT_THAT(submit.err, HasSubstr("interrupted while models were asked for: 'kinevox jobs --server "));
}

}  // namespace
}  // namespace kvx
