// The queue's promises: a lease can be lost, a late worker changes nothing,
// attempts end, events are replayed in order.
#include "storage/job_queue.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <thread>

#include "core/errors.h"
#include "storage/files/data_folder.h"
#include "storage/webhook_outbox.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

struct QueueWorld {
  testing_support::ScratchFolder scratch;
  int64_t now_ms = 1000, set_ahead_ms = 0;  // the second: of the wall clock, by hand
  Database database{scratch.path() / "test.db", [this] { return now_ms + set_ahead_ms; },
                    [this] { return now_ms; }};
  JobQueue jobs{database, 500};
  JobRecord Submit(int priority = 0, int max_attempts = 3) {
    return jobs.Submit({"build_model", "mdl", "{}", priority, max_attempts});
  }
};

TEST(JobQueue, ClaimsByPriorityThenInOrder) {
  QueueWorld w;
  const auto first = w.Submit(), second = w.Submit(), urgent = w.Submit(5);
  EXPECT_EQ(w.jobs.Claim("a")->id, urgent.id);
  EXPECT_EQ(w.jobs.Claim("a")->id, first.id);
  EXPECT_EQ(w.jobs.Claim("a")->id, second.id);
  EXPECT_FALSE(w.jobs.Claim("a"));
}

// It may be megabytes: who works on the job has it, and who asks for it.
TEST(JobQueue, ARequestIsKeptBesideItsJob) {
  QueueWorld w;
  const std::string request = "{\"key_frames\":\"" + std::string(1 << 20, 'x') + "\"}";
  const std::string id = w.jobs.Submit({"animation", "mdl", request}).id;
  EXPECT_EQ(w.jobs.RequestOf(id), request);
  EXPECT_EQ(w.jobs.Claim("a")->request, request);
  EXPECT_THROW(w.jobs.RequestOf("job_none"), NotFound);
  EXPECT_THROW(w.jobs.ForProject("another").RequestOf(id), NotFound);
}

TEST(JobQueue, AClockThatIsSetLosesNoWorker) {
  QueueWorld w;
  w.Submit();
  const ClaimedJob job = *w.jobs.Claim("a");
  for (const int64_t ahead : {30'000, -3'600'000}) {
    w.set_ahead_ms = ahead;
    w.jobs.Sweep();
    EXPECT_NO_THROW(w.jobs.Report(job, "x", 0.5)) << ahead;
  }
}

TEST(JobQueue, ALeaseOfBeforeTheMachineStartedAnewHasEnded) {
  QueueWorld w;
  w.now_ms = 1'000'000'000;
  w.Submit();
  w.jobs.Claim("a");
  w.now_ms = 5000, w.set_ahead_ms = 1'000'000'000;
  EXPECT_EQ(w.jobs.Claim("b")->attempt, 2);
}

TEST(JobQueue, ALateWorkerChangesNothing) {
  QueueWorld w;
  const std::string id = w.Submit().id;
  const ClaimedJob late = *w.jobs.Claim("a");
  w.now_ms += 501;  // its lease has run out
  const ClaimedJob now = *w.jobs.Claim("b");
  EXPECT_EQ(now.attempt, 2);
  EXPECT_THROW(w.jobs.Report(late, "x", 0.9), Conflict);
  EXPECT_THROW(w.jobs.Succeed(late, "{}"), Conflict);
  EXPECT_THROW(w.jobs.Fail(late, "{}"), Conflict);
  EXPECT_THROW(w.jobs.EndCancelled(late), Conflict);
  EXPECT_THROW(w.jobs.GiveBack(late), Conflict);
  EXPECT_THROW(w.jobs.RetryLater(late, 1), Conflict);
  EXPECT_THROW(w.jobs.Renew(late), Conflict);
  const JobRecord job = w.jobs.Require(id);
  EXPECT_EQ(job.state, "running");
  EXPECT_EQ(job.stage, "");
  w.jobs.Succeed(now, R"({"ok":1})");
  EXPECT_EQ(w.jobs.Require(id).state, "succeeded");
  EXPECT_THROW(w.jobs.Fail(now, "{}"), Conflict) << "an ended job ends once";
}

TEST(JobQueue, WhatAJobMadeIsRecordedWithItsEndOrNotAtAll) {
  QueueWorld w;
  const std::string id = w.Submit().id;
  const ClaimedJob late = *w.jobs.Claim("a");
  w.now_ms += 501;
  const ClaimedJob now = *w.jobs.Claim("b");
  int recorded = 0;
  EXPECT_THROW(w.jobs.Succeed(late, "{}", [&] { ++recorded; }), Conflict);
  EXPECT_EQ(recorded, 0) << "the lease is checked first";
  EXPECT_THROW(w.jobs.Succeed(now, "{}", [] { throw Unavailable("no room"); }), Unavailable);
  EXPECT_EQ(w.jobs.Require(id).state, "running") << "the end is rolled back with what it records";
  w.jobs.Succeed(now, "{}", [&] { ++recorded; });
  EXPECT_EQ(w.jobs.Require(id).state, "succeeded");
  EXPECT_EQ(recorded, 1);
}

TEST(JobQueue, AHeartbeatKeepsTheLease) {
  QueueWorld w;
  w.Submit();
  const ClaimedJob job = *w.jobs.Claim("a");
  for (int i = 0; i < 5; ++i) {
    w.now_ms += 400;
    EXPECT_FALSE(w.jobs.Renew(job));
    EXPECT_FALSE(w.jobs.Claim("b"));
  }
}

TEST(JobQueue, AttemptsAreCountedAtClaimAndEnd) {
  QueueWorld w;
  const std::string id = w.Submit(0, 2).id;
  for (int attempt = 1; attempt <= 2; ++attempt) {
    EXPECT_EQ(w.jobs.Claim("a")->attempt, attempt);
    w.now_ms += 501;
  }
  EXPECT_FALSE(w.jobs.Claim("a"));
  const JobRecord job = w.jobs.Require(id);
  EXPECT_EQ(job.state, "failed");
  EXPECT_NE(job.error->find(R"("type":"urn:kinevox:problem:attempts-exhausted")"), std::string::npos);
}

TEST(JobQueue, AJobThatEndsThreeWorkersHasFailed) {
  QueueWorld w;
  const std::string id = w.Submit(0, 9).id;
  for (int lost = 1; lost <= 3; ++lost) {
    ASSERT_TRUE(w.jobs.Claim("a"));
    w.now_ms += 501;
  }
  w.jobs.Sweep();  // a service without workers looks too
  const JobRecord job = w.jobs.Require(id);
  EXPECT_EQ(job.state, "failed");
  EXPECT_NE(job.error->find("three times"), std::string::npos);
  EXPECT_FALSE(w.jobs.Claim("a"));
}

TEST(JobQueue, AJobWaitsForTheMemoryThatItDeclares) {
  QueueWorld w;
  w.jobs.set_memory_budget(100);
  const auto submit = [&](int64_t need) {
    NewJob job{"build_model", "mdl", "{}"};
    job.need_bytes = need;
    return w.jobs.Submit(job).id;
  };
  const std::string first = submit(60), large = submit(50), small = submit(10);
  const ClaimedJob running = *w.jobs.Claim("a");
  EXPECT_EQ(running.id, first);
  EXPECT_FALSE(w.jobs.Claim("b")) << "60 + 50 are more than 100, and the small one does not overtake";
  w.jobs.Succeed(running, "{}");
  EXPECT_EQ(w.jobs.Claim("a")->id, large);
  EXPECT_EQ(w.jobs.Claim("b")->id, small);
  EXPECT_THROW(w.jobs.RequireAdmissible(101), InputError);
  EXPECT_NO_THROW(w.jobs.RequireAdmissible(100));
}

TEST(JobQueue, AJobBeyondAllMemoryRunsAlone) {
  QueueWorld w;
  NewJob huge{"build_model", "mdl", "{}"};
  huge.need_bytes = 500;
  w.jobs.set_memory_budget(100);  // lowered after the job was accepted
  const std::string id = w.jobs.Submit(huge).id;
  EXPECT_EQ(w.jobs.Claim("a")->id, id);
}

TEST(JobQueue, TheEndOfAJobPutsAMessageInTheOutbox) {
  QueueWorld w;
  WebhookOutbox outbox(w.database);
  const Webhook all =
      outbox.Add("http://a.example/", "whsec_", R"(["job.succeeded","job.failed","job.cancelled"])");
  const Webhook failures = outbox.Add("http://b.example/", "whsec_", R"(["job.failed"])");
  const std::string id = w.Submit().id;
  const ClaimedJob job = *w.jobs.Claim("a");
  w.jobs.Report(job, "load", 0.5);
  EXPECT_FALSE(outbox.NextDue());
  EXPECT_THROW(w.jobs.Succeed(job, "{}", [] { throw Unavailable("no room"); }), Unavailable);
  EXPECT_FALSE(outbox.NextDue()) << "the message is rolled back with the end";
  w.jobs.Succeed(job, "{}");
  const auto message = outbox.NextDue();
  ASSERT_TRUE(message);
  EXPECT_EQ(message->type, "job.succeeded");
  EXPECT_NE(message->body.find(id), std::string::npos);
  EXPECT_TRUE(outbox.Deliveries(failures.id, 10).empty());
  outbox.Postpone(message->id, 1000, "no answer");
  EXPECT_FALSE(outbox.NextDue());
  w.now_ms += 1000;
  EXPECT_EQ(outbox.NextDue()->attempt, 1);
  outbox.Delivered(message->id, "taken");
  EXPECT_FALSE(outbox.NextDue());
  EXPECT_EQ(outbox.Deliveries(all.id, 10).at(0).state, "delivered");
  outbox.Remove(all.id);
  EXPECT_THROW(outbox.Remove(all.id), NotFound);
}

TEST(JobQueue, AWorkerThatStopsOnRequestGivesItsAttemptBack) {
  QueueWorld w;
  w.Submit(0, 1);
  const ClaimedJob job = *w.jobs.Claim("a");
  w.jobs.GiveBack(job);
  EXPECT_EQ(w.jobs.Claim("b")->attempt, 1);
}

TEST(JobQueue, ARetryWaitsForItsTime) {
  QueueWorld w;
  w.Submit();
  w.jobs.RetryLater(*w.jobs.Claim("a"), 1000);
  EXPECT_FALSE(w.jobs.Claim("a"));
  w.now_ms += 1000;
  EXPECT_EQ(w.jobs.Claim("a")->attempt, 2);
}

TEST(JobQueue, ARetryIsDueThoughTheClockIsSetBack) {
  QueueWorld w;
  w.Submit();
  w.set_ahead_ms = 365 * kDayMs;
  w.jobs.RetryLater(*w.jobs.Claim("a"), 1000);
  w.set_ahead_ms = 0;
  EXPECT_FALSE(w.jobs.Claim("a"));
  w.now_ms += kLongestRetryMs;
  EXPECT_EQ(w.jobs.Claim("a")->attempt, 2);
}

TEST(JobQueue, CancelsQueuedJobsAtOnceAndAsksRunningOnes) {
  QueueWorld w;
  const std::string running = w.Submit().id;
  const ClaimedJob claimed = *w.jobs.Claim("a");
  const std::string queued = w.Submit().id;
  EXPECT_EQ(w.jobs.Cancel(queued).state, "cancelled");
  EXPECT_THROW(w.jobs.Cancel(queued), Conflict);
  EXPECT_EQ(w.jobs.Cancel(running).state, "running");
  EXPECT_TRUE(w.jobs.Renew(claimed));
  w.jobs.EndCancelled(claimed);
  EXPECT_EQ(w.jobs.Require(running).state, "cancelled");
  EXPECT_THROW(w.jobs.Cancel("job_none"), NotFound);
}

TEST(JobQueue, AJobCancelledWhileItsWorkerIsGoneIsNotClaimedAgain) {
  QueueWorld w;
  const std::string id = w.Submit().id;
  w.jobs.Claim("a");
  w.jobs.Cancel(id);
  w.now_ms += 501;
  EXPECT_FALSE(w.jobs.Claim("b"));
  EXPECT_EQ(w.jobs.Require(id).state, "cancelled");
}

TEST(JobQueue, EventsGrowAndAreReplayedFromAnyPoint) {
  QueueWorld w;
  const std::string id = w.Submit().id;
  w.Submit();  // another job's events are not mixed in
  const ClaimedJob job = *w.jobs.Claim("a");
  w.jobs.Report(job, "load", 0.25);
  w.jobs.Succeed(job, "{}");
  const auto all = w.jobs.EventsAfter(id, 0);
  ASSERT_EQ(all.size(), 4u);
  EXPECT_EQ(all[0].state, "queued");
  EXPECT_EQ(all[1].state, "running");
  EXPECT_EQ(all[2].stage, "load");
  EXPECT_EQ(all[2].progress, 0.25);
  EXPECT_EQ(all[3].state, "succeeded");
  EXPECT_EQ(all[3].progress, 1.0);
  for (size_t i = 1; i < all.size(); ++i) EXPECT_GT(all[i].id, all[i - 1].id);
  EXPECT_EQ(w.jobs.EventsAfter(id, all[2].id).size(), 1u);
}

TEST(JobQueue, ManyWorkersNeverShareAJob) {
  QueueWorld w;
  std::set<std::string> submitted, claimed;
  for (int i = 0; i < 24; ++i) submitted.insert(w.Submit().id);
  std::mutex mutex;
  std::vector<std::thread> workers;
  for (int i = 0; i < 4; ++i) {
    workers.emplace_back([&] {
      while (const auto job = w.jobs.Claim("w")) {
        w.jobs.Succeed(*job, "{}");
        const std::lock_guard lock(mutex);
        EXPECT_TRUE(claimed.insert(job->id).second);
      }
    });
  }
  for (auto& worker : workers) worker.join();
  EXPECT_EQ(claimed, submitted);
}

TEST(JobQueue, PagesAreNewestFirstAndDoNotShift) {
  QueueWorld w;
  std::vector<std::string> ids;
  for (int i = 0; i < 5; ++i) ids.push_back(w.Submit().id);
  const auto first = w.jobs.List({.limit = 2});
  w.Submit();  // lands before the page, not in it
  const auto second = w.jobs.List({.before = *first.next_before, .limit = 2});
  const auto third = w.jobs.List({.before = *second.next_before, .limit = 2});
  EXPECT_EQ(first.items[0].id, ids[4]);
  EXPECT_EQ(second.items[0].id, ids[2]);
  ASSERT_EQ(third.items.size(), 1u);
  EXPECT_EQ(third.items[0].id, ids[0]);
  EXPECT_FALSE(third.next_before);
}

TEST(DataFolder, OneServiceAndAnyNumberOfWorkers) {
  const testing_support::ScratchFolder scratch;
  const auto service = std::make_unique<DataFolder>(scratch.path());
  EXPECT_TRUE(service->alone());
  service->LetWorkersIn();
  const DataFolder worker(scratch.path(), DataFolder::Use::kWorker),
      another(scratch.path(), DataFolder::Use::kWorker);
  EXPECT_THROW(DataFolder second(scratch.path()), Conflict);
  std::ofstream(worker.work() / "in use") << "x";
}

TEST(DataFolder, AServiceThatStartsBesideWorkersLeavesTheirWorkAlone) {
  const testing_support::ScratchFolder scratch;
  {
    const DataFolder worker(scratch.path(), DataFolder::Use::kWorker);
    std::ofstream(worker.work() / "in use") << "x";
    const DataFolder service(scratch.path());
    EXPECT_FALSE(service.alone());
    EXPECT_TRUE(std::filesystem::exists(service.work() / "in use"));
  }
  const DataFolder later(scratch.path());
  EXPECT_TRUE(later.alone());
  EXPECT_FALSE(std::filesystem::exists(later.work() / "in use"));
}

TEST(DataFolder, OnlyOneServiceMayUseIt) {
  const testing_support::ScratchFolder scratch;
  {
    const DataFolder first(scratch.path());
    EXPECT_THROW(DataFolder second(scratch.path()), Conflict);
  }
  EXPECT_NO_THROW(DataFolder again(scratch.path()));
}

}  // namespace
}  // namespace kvx
