// A failure is logged and forgotten: the next round tries again.
#include "server/janitor.h"

#include <chrono>

#include "api/handlers/subjects.h"
#include "server/log.h"

namespace kvx {
namespace {

constexpr auto kRound = std::chrono::seconds(2);
constexpr int64_t kRoundsPerMinute = 30, kRoundsPerHour = 1800;
// Longer than any upload takes from its last byte to its record
constexpr auto kBlobGrace = std::chrono::hours(1);

}  // namespace

Janitor::Janitor(Services& services) : services_(services), thread_([this] { Run(); }) {}

void Janitor::Stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  asked_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Janitor::Run() {
  for (int64_t number = 0;; ++number) {
    try {
      Round(number);
    } catch (...) {
      seldom_.Error("janitor", {{"error", DescribeForLog(std::current_exception())}});
    }
    std::unique_lock lock(mutex_);
    if (asked_.wait_for(lock, kRound, [this] { return stopping_; })) return;
  }
}

void Janitor::Round(int64_t number) {
  services_.jobs.Sweep();
  if (number % kRoundsPerMinute == 0) {
    services_.resumable.RemoveExpired();
    services_.retention.EmptyLog();
    services_.webhooks.PullInWaiting();
    services_.results.CountOthers();
  }
  if (number % kRoundsPerHour != 0) return;
  services_.webhooks.ForgetOlderThan(30 * kDayMs);
  services_.idempotency.ForgetOlderThan(7 * kDayMs);
  services_.blobs.RemoveAbandoned(std::chrono::hours(24));
  const int removed =
      services_.blobs.RemoveUnused([this] { return services_.catalogue.BlobsInUse(); }, kBlobGrace);
  if (removed > 0) LogInfo("unused bytes removed", {{"blobs", int64_t(removed)}});
  services_.retention.RemoveBytes([this](const std::string& model) { RemoveModelBytes(services_, model); });
}

}  // namespace kvx
