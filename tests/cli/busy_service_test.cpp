// The real program against a service that has no time: what it says while it waits, and when it does not.
#include <gmock/gmock.h>
#include <signal.h>

#include <atomic>
#include <thread>

#include "tests/support/hinge_study.h"
#include "tests/support/listening_server.h"
#include "tests/support/program_test.h"

namespace kvx {
namespace {

using testing_support::Ended;
using testing_support::Program;

// Gives every request this answer.
class Busy {
 public:
  Busy(int status, const std::string& retry_after) {
    const auto answer = [this, status, retry_after](const httplib::Request&, httplib::Response& response) {
      ++tries;
      response.status = status;
      response.set_header("Retry-After", retry_after);
      response.set_content(R"({"detail": "being upgraded; it will not take long"})",
                           "application/problem+json");
    };
    server_.http.Get(".*", answer);
    server_.http.Post(".*", answer);
    server_.http.Delete(".*", answer);
    server_.Listen();
  }
  std::string url() const { return server_.url(); }
  mutable std::atomic<int> tries = 0;

 private:
  testing_support::ListeningServer server_;
};

class BusyService : public testing_support::ProgramTest {
 protected:
  std::vector<std::string> Submit(const Busy& service) const {
    const auto study = testing_support::WriteHingeStudy(scratch.path());
    return {"submit", study.string(), "--server", service.url()};
  }
};

TEST_F(BusyService, IsWaitedForAloudAndAnInterruptionSaysThatTheSameCommandGoesOn) {
  const Busy service(503, "1");
  Program submit(scratch.path(), Submit(service));
  while (submit.Running() && service.tries < 2) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  submit.Signal(SIGINT);
  const Ended ended = submit.Wait();
  EXPECT_EQ(ended.code, 130);
  EXPECT_THAT(ended.err, testing::HasSubstr("waiting: being upgraded\n"));
  EXPECT_THAT(ended.err, testing::HasSubstr("go on: what has arrived is not sent again"));
}

TEST_F(BusyService, ATerminalThatGoesInterruptsUnlessThatIsIgnored) {
  const Busy service(503, "1");
  for (const auto handling : {SIG_DFL, SIG_IGN}) {
    service.tries = 0;
    const auto before = std::signal(SIGHUP, handling);  // as nohup, the program has it from here
    Program command(scratch.path(), Submit(service));
    std::signal(SIGHUP, before);
    while (command.Running() && service.tries < 2) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    command.Signal(SIGHUP);
    if (handling == SIG_IGN) {
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      EXPECT_TRUE(command.Running());
      command.Signal(SIGINT);
    }
    EXPECT_EQ(command.Wait().code, 130);
  }
}

TEST_F(BusyService, JobsAndCancelWaitForItToo) {
  const Busy service(503, "1");
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"jobs"}, {"cancel", "job_a", "job_b"}}) {
    service.tries = 0;
    std::vector<std::string> all = words;
    all.insert(all.end(), {"--server", service.url()});
    const auto before = std::signal(SIGINT, SIG_IGN);  // as where tests run in the background
    Program command(scratch.path(), all);
    std::signal(SIGINT, before);
    while (command.Running() && service.tries < 3) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    command.Signal(SIGINT);
    EXPECT_EQ(command.Wait().err, "kinevox: waiting: being upgraded\n") << words[0];
  }
}

TEST_F(BusyService, WhatWasNotCancelledIsToldForEach) {
  const Busy service(429, "50000");
  const Ended ended = Run({"cancel", "job_a", "bat_b", "--server", service.url(), "--json"});
  EXPECT_EQ(ended.code, 6);
  EXPECT_EQ(service.tries, 1) << "nothing else would be answered either";
  const nlohmann::json told = nlohmann::json::parse(ended.out, nullptr, false);
  ASSERT_EQ(told.size(), 2u) << ended.out;
  EXPECT_EQ(told[1]["id"], "bat_b");
  EXPECT_EQ(told[1]["state"], "not cancelled");
}

TEST_F(BusyService, AQuotaOfTheDayEndsTheCommandAtOnce) {
  const Busy service(429, "50000");
  const Ended ended = Run(Submit(service));
  EXPECT_EQ(ended.code, 6);
  EXPECT_THAT(ended.err, testing::HasSubstr("in 14 h"));
  EXPECT_EQ(service.tries, 1);
}

}  // namespace
}  // namespace kvx
