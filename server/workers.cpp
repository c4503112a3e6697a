// A late worker changes nothing: all that it writes is fenced by its lease.
#include "server/workers.h"

#include <chrono>

#include "api/errors.h"
#include "server/log.h"

namespace kvx {
namespace {

using SteadyClock = std::chrono::steady_clock;
constexpr auto kReportAtMostEvery = std::chrono::milliseconds(500);
constexpr auto kLookAgainAfter = std::chrono::milliseconds(1000);
constexpr int64_t kFirstRetryMs = 2000;

int64_t SteadyMs() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(SteadyClock::now().time_since_epoch()).count();
}

}  // namespace

Workers::Workers(Services& services, Metrics& metrics, int threads) : services_(services), kinds_(AllJobKinds(services)), metrics_(metrics) {
  for (int i = 0; i < threads; ++i) {
    threads_.emplace_back([this, i] { Work("worker-" + std::to_string(i)); });
  }
  heartbeat_ = std::thread([this] { Heartbeat(); });
}

void Workers::Stop() {
  if (stopping_.exchange(true)) return;
  services_.jobs.WakeAll();
  for (std::thread& thread : threads_) thread.join();
  heartbeat_.join();
}

void Workers::Work(const std::string& name) {
  uint64_t seen = 0;
  while (!stopping_) {
    try {
      if (const auto job = services_.jobs.Claim(name)) {
        Run(*job);
        continue;
      }
    } catch (...) {
      LogError("worker", {{"worker", name}, {"error", DescribeForLog(std::current_exception())}});
    }
    seen = services_.jobs.WaitForChange(seen, kLookAgainAfter);
  }
}

void Workers::Run(const ClaimedJob& job) {
  LogInfo("job started", {{"job", job.id}, {"kind", job.kind}, {"attempt", job.attempt}});
  const auto running = std::make_shared<Running>();
  running->job = job;
  running->renewed_ms = SteadyMs();
  {
    const std::lock_guard lock(mutex_);
    running_.push_back(running);
  }
  try {
    RunJobOf(*running);
  } catch (...) {
    EndWithError(*running, std::current_exception());
  }
  const std::lock_guard lock(mutex_);
  running_.remove(running);
}

void Workers::RunJobOf(Running& running) {
  const auto kind = kinds_.find(running.job.kind);
  if (kind == kinds_.end()) throw InputError("this version of kinevox does not know jobs of this kind");
  const JobOutcome outcome = kind->second(running.job, ProgressOf(running));
  services_.jobs.Succeed(running.job, outcome.result, outcome.record);
  ++metrics_.jobs_succeeded;
  LogInfo("job succeeded", {{"job", running.job.id}, {"kind", running.job.kind}});
}

// What a job's end looks like when the build threw. A failure to write it down leaves the lease to run out.
void Workers::EndWithError(Running& running, std::exception_ptr error) try {
  const std::string& id = running.job.id;
  if (running.lost) return LogError("job lost", {{"job", id}});
  try {
    std::rethrow_exception(error);
  } catch (const Cancelled&) {
    if (!running.cancel && stopping_) return services_.jobs.GiveBack(running.job);
    services_.jobs.EndCancelled(running.job);
    ++metrics_.jobs_cancelled;
    return LogInfo("job cancelled", {{"job", id}});
  } catch (const Unavailable&) {
    if (running.job.attempt < services_.jobs.Require(id).max_attempts) {
      LogError("job will be retried", {{"job", id}, {"error", DescribeForLog(error)}});
      return services_.jobs.RetryLater(running.job, kFirstRetryMs << running.job.attempt);
    }
  } catch (...) {
  }
  services_.jobs.Fail(running.job, JobErrorJson(ToProblem(error)));
  ++metrics_.jobs_failed;
  LogError("job failed", {{"job", id}, {"error", DescribeForLog(error)}});
} catch (...) {
  LogError("job end not stored", {{"job", running.job.id}, {"error", DescribeForLog(std::current_exception())}});
}

Progress Workers::ProgressOf(Running& running) {
  struct Last {
    std::mutex mutex;
    std::string stage;
    SteadyClock::time_point at{};
  };
  const auto last = std::make_shared<Last>();
  const auto sink = [this, &running, last](std::string_view stage, double fraction) {
    const std::lock_guard lock(last->mutex);
    if (stage == last->stage && SteadyClock::now() - last->at < kReportAtMostEvery) return;
    try {
      services_.jobs.Report(running.job, std::string(stage), fraction);
    } catch (const Conflict&) {
      running.lost = true;
      throw;
    } catch (const Unavailable&) {  // a report is no reason to give up
    }
    last->stage = stage;
    last->at = SteadyClock::now();
  };
  return Progress(sink, [this, &running] { return stopping_ || running.cancel || running.lost; });
}

void Workers::Heartbeat() {
  uint64_t seen = 0;
  while (true) {
    seen = services_.jobs.WaitForChange(seen, kLookAgainAfter);
    std::list<std::shared_ptr<Running>> running;
    {
      const std::lock_guard lock(mutex_);
      running = running_;
    }
    if (stopping_ && running.empty()) return;
    for (const auto& job : running) Beat(*job);
    if (stopping_) std::this_thread::sleep_for(std::chrono::milliseconds(20));  // until the last job is given back
  }
}

void Workers::Beat(Running& running) try {
  if (running.lost) return;
  if (SteadyMs() - running.renewed_ms > services_.jobs.lease_ms() / 3) {
    running.cancel = services_.jobs.Renew(running.job);
    running.renewed_ms = SteadyMs();
  } else if (services_.jobs.Require(running.job.id).cancel_requested) {
    running.cancel = true;
  }
} catch (const Conflict&) {
  running.lost = true;
} catch (...) {
  LogError("heartbeat", {{"job", running.job.id}, {"error", DescribeForLog(std::current_exception())}});
}

}  // namespace kvx
