// Whose message goes next, and who waits for whom.
#include "storage/webhook_outbox.h"

#include <gtest/gtest.h>

#include "core/errors.h"
#include "storage/job_queue.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

constexpr char kSecret[] = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw";

struct OutboxWorld {
  testing_support::ScratchFolder scratch;
  int64_t now_ms = 1000;
  Database database{scratch.path() / "test.db", [this] { return now_ms; }};
  JobQueue jobs{database};
  WebhookOutbox outbox{database};

  void Hook(const std::string& url) { outbox.Add(url, kSecret, kEvents); }
  void EndAJob(const std::string& project) {
    JobQueue of_project = jobs.ForProject(project);
    of_project.Cancel(of_project.Submit({"build_model", "mdl_x", "{}"}).id);
  }
  void EndAJob() { jobs.Cancel(jobs.Submit({"build_model", "mdl_x", "{}"}).id); }

  static constexpr char kEvents[] = R"(["job.cancelled"])";
};

const std::string kDeaf = "https://deaf.example/hook", kHears = "https://hears.example/hook";

// Two messages of a receiver that does not answer, then one of another.
struct TwoReceivers : OutboxWorld {
  TwoReceivers() {
    Hook(kDeaf);
    EndAJob();
    Hook(kHears);
    EndAJob();
  }
};

TEST(WebhookOutbox, WhoDidNotTakeOneIsNotAskedAgainBeforeTheOthers) {
  TwoReceivers w;
  const WebhookMessage first = *w.outbox.NextDue();
  ASSERT_EQ(first.url, kDeaf);
  w.outbox.Postpone(first.id, 5000, "no answer");
  const WebhookMessage next = *w.outbox.NextDue();
  EXPECT_EQ(next.url, kHears);
  w.outbox.Delivered(next.id, "taken");
  EXPECT_FALSE(w.outbox.NextDue());
  w.now_ms += 5000;
  EXPECT_EQ(w.outbox.NextDue()->url, kDeaf);
}

TEST(WebhookOutbox, ProjectsTakeTurns) {
  OutboxWorld w;
  for (const char* project : {"a", "b"}) {
    w.outbox.ForProject(project).Add(std::string("https://") + project + ".example/", kSecret, w.kEvents);
    for (int i = 0; i < 2; ++i) w.EndAJob(project);
  }
  std::string last, order;
  for (int i = 0; i < 4; ++i) {
    const WebhookMessage next = *w.outbox.NextDue(last);
    last = next.project;
    order += next.project;
    w.outbox.Delivered(next.id, "taken");
  }
  EXPECT_EQ(order, "abab");
}

TEST(WebhookOutbox, AllWebhooksOfAProjectAtADeafHostWait) {
  OutboxWorld w;
  const auto add = [&](const char* project, const char* url) {
    w.outbox.ForProject(project).Add(url, kSecret, w.kEvents);
  };
  add("greedy", "https://Deaf.example/1");
  add("greedy", "https://deaf.example");
  add("greedy", "https://deaf.example.org/1");
  add("other", "https://deaf.example/1");
  w.EndAJob("greedy");
  w.EndAJob("other");
  w.outbox.Postpone(w.outbox.NextDue()->id, 5000, "no answer");
  std::vector<std::string> left;
  while (const auto next = w.outbox.NextDue()) {
    left.push_back(next->url);
    w.outbox.Delivered(next->id, "taken");
  }
  EXPECT_EQ(left, (std::vector<std::string>{"https://deaf.example.org/1", "https://deaf.example/1"}))
      << "another host, and another project";
}

TEST(WebhookOutbox, AProjectHasTwentyAtMost) {
  OutboxWorld w;
  WebhookOutbox greedy = w.outbox.ForProject("greedy");
  for (int i = 0; i < kMostWebhooks; ++i) greedy.Add(kDeaf, kSecret, w.kEvents);
  EXPECT_THROW(greedy.Add(kDeaf, kSecret, w.kEvents), Conflict);
  EXPECT_NO_THROW(w.outbox.ForProject("other").Add(kHears, kSecret, w.kEvents));
  greedy.Remove(greedy.List({}).items.at(0).id);
  EXPECT_NO_THROW(greedy.Add(kDeaf, kSecret, w.kEvents));
}

TEST(WebhookOutbox, TheOthersOfWhoDidNotTakeOneWaitAMinuteAtMost) {
  TwoReceivers w;
  const WebhookMessage first = *w.outbox.NextDue();
  w.outbox.Postpone(first.id, 3'600'000, "no answer");
  w.outbox.Delivered(w.outbox.NextDue()->id, "taken");
  w.now_ms += 59'999;
  EXPECT_FALSE(w.outbox.NextDue());
  w.now_ms += 1;
  const WebhookMessage second = *w.outbox.NextDue();
  EXPECT_EQ(second.url, kDeaf);
  EXPECT_NE(second.id, first.id);
  w.outbox.Delivered(second.id, "taken");
  EXPECT_FALSE(w.outbox.NextDue()) << "the first waits for its hour";
}

TEST(WebhookOutbox, MessagesAreDueThoughTheClockIsSetBack) {
  TwoReceivers w;
  const int64_t right_ms = w.now_ms;
  w.now_ms += 365 * kDayMs;
  w.outbox.Postpone(w.outbox.NextDue()->id, 5000, "no answer");
  w.EndAJob();
  w.now_ms = right_ms;
  w.outbox.Delivered(w.outbox.NextDue()->id, "taken");  // of before
  EXPECT_FALSE(w.outbox.NextDue());
  w.outbox.PullInWaiting();
  w.now_ms += 60'000;
  std::vector<std::string> due;
  for (int untried = 0; untried < 3; ++untried) {
    due.push_back(w.outbox.NextDue()->url);
    w.outbox.Delivered(w.outbox.NextDue()->id, "taken");
  }
  EXPECT_EQ(due, (std::vector<std::string>{kDeaf, kDeaf, kHears}));
  EXPECT_FALSE(w.outbox.NextDue()) << "the one that was postponed waits for its day";
  w.now_ms = right_ms + kLongestPostponedMs;
  EXPECT_EQ(w.outbox.NextDue()->url, kDeaf);
}

}  // namespace
}  // namespace kvx
