// Whose message goes next, and who waits for whom.
#include "storage/webhook_outbox.h"

#include <gtest/gtest.h>

#include "storage/job_queue.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

struct OutboxWorld {
  testing_support::ScratchFolder scratch;
  int64_t now_ms = 1000;
  Database database{scratch.path() / "test.db", [this] { return now_ms; }};
  JobQueue jobs{database};
  WebhookOutbox outbox{database};

  void Hook(const std::string& url) { outbox.Add(url, "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw", kEvents); }
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

}  // namespace
}  // namespace kvx
