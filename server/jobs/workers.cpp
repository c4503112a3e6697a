// A late worker changes nothing: all that it writes is fenced by its lease.
#include "server/jobs/workers.h"

#include <chrono>

#include "api/errors.h"
#include "api/room_watch.h"
#include "server/log.h"
#include "server/ports/device_errors.h"

namespace kvx {
namespace {

constexpr int64_t kLeastOfAJob = int64_t(1) << 20;  // beyond the reserve, which may be 0

using SteadyClock = std::chrono::steady_clock;
constexpr auto kReportAtMostEvery = std::chrono::milliseconds(500);
constexpr auto kLookAgainAfter = std::chrono::milliseconds(500);
// A job that does not notice by then is cancelled without its help
constexpr int64_t kCancelPatienceMs = 900;
constexpr int64_t kFirstRetryMs = 2000;

int64_t SteadyMs() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(SteadyClock::now().time_since_epoch()).count();
}

void CloseStage(std::vector<StageTime>& stages, SteadyClock::duration took) {
  if (!stages.empty()) stages.back().seconds = std::chrono::duration<double>(took).count();
}

std::string WithoutScan(std::string_view stage) { return std::string(stage.substr(0, stage.find(' '))); }

// A run that found much of its work done before says nothing of how long work takes.
bool TellsOfTime(const std::vector<StageTime>& stages, double whole_seconds) {
  double spent = 0;
  for (const StageTime& stage : stages) spent += stage.seconds;
  return spent > 0.5 * whole_seconds;
}

}  // namespace

std::string FullDisk(const Services& services) {
  if (!HasRoom(services, kLeastOfAJob)) return "the disk of the data folder is nearly full";
  if (!services.poser.DeviceHasRoom()) return "the disk of PoCL's folder (POCL_CACHE_DIR) is nearly full";
  return "";
}

Workers::Workers(Services& services, int threads, std::stop_token stop)
    : services_(services), kinds_(AllJobKinds(services)), asked_(std::move(stop), [this] { AskToStop(); }) {
  try {
    for (int i = 0; i < threads; ++i)
      threads_.emplace_back([this, i] { Work("worker-" + std::to_string(i)); });
    heartbeat_ = std::thread([this] { Heartbeat(); });
  } catch (...) {  // the system gives no more threads
    Stop();
    throw;
  }
}

void Workers::AskToStop() {
  stopping_ = true;
  services_.jobs.WakeAll();
}

void Workers::Stop() {
  if (threads_.empty() && !heartbeat_.joinable()) return;
  AskToStop();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
  if (heartbeat_.joinable()) heartbeat_.join();
}

void Workers::Work(const std::string& name) {
  uint64_t seen = 0;
  while (!stopping_) {
    try {
      if (const auto job = ClaimWhereThereIsRoom(name)) {
        Run(*job);
        continue;
      }
    } catch (...) {
      seldom_.Error("worker", {{"worker", name}, {"error", DescribeForLog(std::current_exception())}});
    }
    seen = services_.jobs.WaitForChange(seen, kLookAgainAfter);
  }
}

std::optional<ClaimedJob> Workers::ClaimWhereThereIsRoom(const std::string& name) {
  const std::string full = FullDisk(services_);
  if (full.empty()) return services_.jobs.Claim(name);
  seldom_.Error("no job is begun", {{"error", full}});
  return std::nullopt;
}

// Whatever is thrown: a job that stays among the running ones keeps its lease for ever.
std::shared_ptr<void> Workers::Among(const std::shared_ptr<Running>& running) {
  const auto end = [this, running](void*) {
    const std::lock_guard lock(mutex_);
    running_.remove(running);
  };
  std::shared_ptr<void> among(nullptr, end);
  const std::lock_guard lock(mutex_);
  running_.push_back(running);
  return among;
}

void Workers::Run(const ClaimedJob& job) {
  LogInfo("job started", {{"job", job.id}, {"kind", job.kind}, {"attempt", job.attempt}});
  const auto running = std::make_shared<Running>();
  running->job = job;
  running->renewed_ms = SteadyMs();
  const auto among = Among(running);
  try {
    RunJobOf(*running);
  } catch (...) {
    EndWithError(*running, AsOurKind(std::current_exception()));
  }
}

void Workers::RunJobOf(Running& running) {
  const auto kind = kinds_.find(running.job.kind);
  if (kind == kinds_.end()) throw InputError("this version of kinevox does not know jobs of this kind");
  const JobOutcome outcome = kind->second(running.job, ProgressOf(running));
  // Read before the transaction: a report holds the job's lock while it writes to the database,
  // so never the other way round.
  const std::vector<StageTime> stages = EndedStages(running);
  services_.jobs.Succeed(running.job, outcome.result, [&] {
    if (outcome.record) outcome.record();
    if (running.job.work > 0 && TellsOfTime(stages, outcome.whole_seconds))
      services_.jobs.RecordStages(running.job, stages);
  });
  LogInfo("job succeeded", {{"job", running.job.id}, {"kind", running.job.kind}});
}

// What a job's end looks like when the build threw. A failure to write it down leaves the lease to run out.
void Workers::EndWithError(Running& running, std::exception_ptr error) try {
  const std::string& id = running.job.id;
  if (running.ended) return;
  if (running.lost) return LogError("job lost", {{"job", id}});
  try {
    std::rethrow_exception(error);
  } catch (const Cancelled&) {
    if (!running.cancel && stopping_) return services_.jobs.GiveBack(running.job);
    services_.jobs.EndCancelled(running.job);
    return LogInfo("job cancelled", {{"job", id}});
  } catch (const Unavailable&) {
    if (running.job.attempt < services_.jobs.Require(id).max_attempts) {
      LogError("job will be retried", {{"job", id}, {"error", DescribeForLog(error)}});
      return services_.jobs.RetryLater(running.job, kFirstRetryMs << running.job.attempt);
    }
  } catch (...) {
  }
  const Problem problem = ToProblem(error);
  services_.jobs.Fail(running.job, JobErrorJson(problem));
  LogError("job failed", {{"job", id},
                          {"stage", StageOf(running)},
                          {"problem", problem.type},
                          {"error", DescribeForLog(error)}});
} catch (...) {
  LogError("job end not stored",
           {{"job", running.job.id}, {"error", DescribeForLog(std::current_exception())}});
}

Progress Workers::ProgressOf(Running& running) {
  return Progress(
      [this, &running](std::string_view stage, double fraction) { Report(running, stage, fraction); },
      [this, &running] { return stopping_ || running.cancel || running.lost; });
}

void Workers::Report(Running& running, std::string_view stage, double fraction) {
  const std::lock_guard lock(running.mutex);
  const auto now = SteadyClock::now();
  const bool next_stage = stage != running.stage || running.stages.empty();
  if (next_stage) {
    CloseStage(running.stages, now - running.stage_began);
    running.stages.push_back({WithoutScan(stage), fraction});
    running.stage = stage;
    running.stage_began = now;
  } else if (now - running.reported < kReportAtMostEvery) {
    return;
  }
  running.reported = now;
  try {
    services_.jobs.Report(running.job, running.stage, fraction);
  } catch (const Conflict&) {
    running.lost = true;
    throw;
  } catch (const Unavailable&) {  // a report is no reason to give up
  }
}

std::string Workers::StageOf(Running& running) {
  const std::lock_guard lock(running.mutex);
  return WithoutScan(running.stage);
}

std::vector<StageTime> Workers::EndedStages(Running& running) {
  const std::lock_guard lock(running.mutex);
  CloseStage(running.stages, SteadyClock::now() - running.stage_began);
  return running.stages;
}

void Workers::Heartbeat() {
  uint64_t seen = 0;
  while (true) {
    seen = services_.jobs.WaitForChange(
        seen, std::min(kLookAgainAfter, std::chrono::milliseconds(services_.jobs.lease_ms() / 4)));
    if (stopping_ && !AnyRuns()) return;
    BeatAll();
    if (stopping_)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));  // until the last job is given back
  }
}

bool Workers::AnyRuns() {
  const std::lock_guard lock(mutex_);
  return !running_.empty();
}

void Workers::BeatAll() try {
  std::list<std::shared_ptr<Running>> running;
  {
    const std::lock_guard lock(mutex_);
    running = running_;
  }
  for (const auto& job : running) Beat(*job);
} catch (...) {  // no memory to tell of a failure: it beats again soon
}

void Workers::Beat(Running& running) try {
  if (running.lost) return;
  if (SteadyMs() - running.renewed_ms > services_.jobs.lease_ms() / 3) {
    running.cancel = services_.jobs.Renew(running.job);
    running.renewed_ms = SteadyMs();
  } else if (services_.jobs.Require(running.job.id).cancel_requested) {
    running.cancel = true;
  }
  if (!running.cancel) return;
  if (running.cancel_seen_ms == 0) running.cancel_seen_ms = SteadyMs();
  if (SteadyMs() - running.cancel_seen_ms < kCancelPatienceMs) return;
  services_.jobs.EndCancelled(
      running.job);  // from here on its thread can change nothing, and ends at its next report
  running.ended = true;
  running.lost = true;
  LogInfo("job cancelled in the middle of a step", {{"job", running.job.id}});
} catch (const Conflict&) {
  running.lost = true;
} catch (...) {
  seldom_.Error("heartbeat", {{"job", running.job.id}, {"error", DescribeForLog(std::current_exception())}});
}

}  // namespace kvx
