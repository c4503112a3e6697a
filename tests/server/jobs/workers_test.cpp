// Jobs of a running service: cancelled, given back, tried again, counted.
#include "server/jobs/workers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>
#include <thread>

#include "server/log.h"
#include "tests/support/failing_new.h"
#include "tests/support/running_server.h"
#include "tests/support/scarce_memory.h"
#include "tests/support/service_world.h"

namespace kvx {
namespace {

using testing_support::ExpectProblem;
using testing_support::RunningServer;

TEST(HttpServer, AJobOfAKindThatNobodyKnowsFailsInWords) {
  RunningServer s;
  const Json job = s.WaitFor(s.world.jobs.Submit({"from_the_future", "", "{}"}).id);
  EXPECT_EQ(job["state"], "failed");
  EXPECT_NE(job["error"]["detail"].get<std::string>().find("jobs of this kind"), std::string::npos);
  EXPECT_TRUE(job["model"].is_null());
}

TEST(Workers, ARunningJobIsCancelled) {
  RunningServer s;
  s.world.builder.Hold();
  const std::string job = s.Model()["job"];
  EXPECT_EQ(s.http.Delete("/v1/jobs/" + job)->status, 202);
  EXPECT_EQ(s.WaitFor(job)["state"], "cancelled");
  ExpectProblem(s.http.Delete("/v1/jobs/" + job), 409);
}

// Whoever watches a log for errors sees none of what a user wished.
TEST(Workers, AJobThatIsCancelledWithoutItsHelpIsNoError) {
  RunningServer s;
  s.world.builder.Hold();
  s.world.builder.deaf = true;
  const std::string job = s.Model()["job"];
  for (int i = 0; i < 1000 && s.world.builder.builds == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  SetLogLevel("error");
  testing::internal::CaptureStderr();
  EXPECT_EQ(s.http.Delete("/v1/jobs/" + job)->status, 202);
  EXPECT_EQ(s.WaitFor(job)["state"], "cancelled");
  s.world.builder.deaf = false;
  s.world.builder.Open();
  s.workers->Stop();  // its thread has ended, too
  SetLogLevel("off");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Workers, StoppingGivesTheJobBackToTheQueue) {
  RunningServer s;
  s.world.builder.Hold();
  const std::string job = s.Model()["job"];
  for (int i = 0; i < 200 && s.world.builder.builds == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  s.workers->Stop();
  const JobRecord record = s.world.jobs.Require(job);
  EXPECT_EQ(record.state, "queued");
  EXPECT_EQ(record.attempt, 0) << "an attempt that was stopped on request does not count";
}

// A service asks for it before it waits for its clients: they may take longer than whoever ends it waits.
TEST(Workers, AreAskedToStopBeforeAnybodyWaitsForThem) {
  RunningServer s({}, false);
  s.world.builder.Hold();
  std::stop_source stop;
  Workers workers(s.world.services, 1, stop.get_token());
  const std::string job = s.Model()["job"];
  for (int i = 0; i < 1000 && s.world.builder.builds == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  stop.request_stop();
  for (int i = 0; i < 1000 && s.world.jobs.Require(job).state != "queued"; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(s.world.builder.builds, 1);
  EXPECT_EQ(s.world.jobs.Require(job).state, "queued");
}

TEST(Workers, PassingFailuresAreRetriedAndOthersNot) {
  RunningServer s({}, false);
  s.world.builder.fail_first = 1;
  const std::string job = s.Model()["job"];
  Workers workers(s.world.services, 1);
  for (int i = 0; i < 200 && s.world.jobs.Require(job).state != "queued"; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  for (int i = 0; i < 200 && s.world.builder.builds == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(s.world.builder.builds, 1);
  EXPECT_NE(s.world.jobs.Require(job).state, "failed");
}

TEST(Workers, AFileThatCannotBeReadIsAPassingFailure) {
  RunningServer s({}, false);
  const auto error = std::make_error_code(std::errc::io_error);
  s.world.builder.beginning = [&] { throw std::filesystem::filesystem_error("open", error); };
  const std::string job = s.Model()["job"];
  Workers workers(s.world.services, 1);
  for (int i = 0; i < 1000 && s.world.builder.builds == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  for (int i = 0; i < 1000 && s.world.jobs.Require(job).state == "running"; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(s.world.jobs.Require(job).state, "queued");
}

TEST(Workers, WantOfMemoryDoesNotEndTheHeartbeat) {
  RunningServer s;
  s.world.builder.Hold();
  s.world.builder.deaf = true;  // its thread asks for no memory meanwhile
  const std::string job = s.Model()["job"];
  for (int i = 0; i < 1000 && s.world.jobs.Require(job).stage != "stage0"; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // until it has told of it
  {
    const testing_support::FailingNewElsewhere failing;
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // two beats and more
  }
  s.world.builder.deaf = false;
  s.world.builder.Open();
  EXPECT_EQ(s.WaitFor(job)["state"], "succeeded");
}

TEST(Workers, ThatGetTooFewThreadsAreRefusedWithoutAnEndOfTheProgram) {
  if (!KVX_MEMORY_CAN_BE_SCARCE) GTEST_SKIP();
  const auto begin = [] {
    testing_support::ServiceWorld world;
    testing_support::GetNoMoreMemoryThan(testing_support::kOneThread);
    try {
      Workers workers(world.services, 2);
    } catch (const std::system_error&) {
      std::_Exit(2);
    }
    std::_Exit(0);
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(begin(), testing::ExitedWithCode(2), "");
}

TEST(JobWatch, CountsWhatAnyProcessDid) {
  RunningServer s({}, false);
  const std::string job = s.Model()["job"];
  const ClaimedJob claimed = *s.world.jobs.Claim("a worker of another process");
  s.world.jobs.Report(claimed, "bones", 0.1);
  s.world.now_ms += 2000;
  s.world.jobs.Report(claimed, "register pose01", 0.5);
  s.world.now_ms += 40'000;
  s.world.jobs.Succeed(claimed, "{}");
  const std::string text = s.http.Get("/metrics")->body;
  for (const char* line : {"kinevox_jobs_succeeded_total 1", "kinevox_stage_seconds_sum{stage=\"bones\"} 2\n",
                           "kinevox_stage_seconds_sum{stage=\"register\"} 40\n",
                           "kinevox_stage_seconds_count{stage=\"register\"} 1"}) {
    EXPECT_THAT(text, testing::HasSubstr(line));
  }
  EXPECT_THAT(s.http.Get("/metrics")->body, testing::HasSubstr("kinevox_jobs_succeeded_total 1\n"));
}

}  // namespace
}  // namespace kvx
