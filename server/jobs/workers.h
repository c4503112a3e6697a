// Threads that claim jobs and run them, and one more that keeps their leases alive whatever they compute.
#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <list>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "api/services.h"
#include "server/jobs/job_kinds.h"
#include "server/seldom_log.h"

namespace kvx {

// For want of which no job is begun; empty where there is room.
std::string FullDisk(const Services& services);

class Workers {
 public:
  // Where `stop` is asked for, running jobs are asked to stop at their next report and go back to the queue.
  Workers(Services& services, int threads, std::stop_token stop = {});
  ~Workers() { Stop(); }
  void Stop();  // the same, and returns when all threads have ended

 private:
  // Shared by the thread that runs a job and the heartbeat.
  struct Running {
    ClaimedJob job;
    std::atomic<bool> cancel{false};
    std::atomic<bool> lost{false};
    std::atomic<bool> ended{false};              // lost, since the heartbeat has cancelled it
    int64_t renewed_ms = 0, cancel_seen_ms = 0;  // the heartbeat's own
    std::mutex mutex;                            // of what follows
    std::string stage;
    std::chrono::steady_clock::time_point stage_began{}, reported{};
    std::vector<StageTime> stages;
  };
  void AskToStop();
  void Work(const std::string& name);
  std::optional<ClaimedJob> ClaimWhereThereIsRoom(const std::string& name);
  std::shared_ptr<void> Among(const std::shared_ptr<Running>& running);  // those that run, while it lives
  void Run(const ClaimedJob& job);
  void RunJobOf(Running& running);
  void EndWithError(Running& running, std::exception_ptr error);
  Progress ProgressOf(Running& running);
  void Report(Running& running, std::string_view stage, double fraction);
  static std::string StageOf(Running& running);  // without the name of the scan
  std::vector<StageTime> EndedStages(Running& running);
  void Heartbeat();
  bool AnyRuns();
  void BeatAll();
  void Beat(Running& running);

  Services& services_;
  JobKinds kinds_;
  SeldomLog seldom_;
  std::atomic<bool> stopping_{false};
  std::mutex mutex_;
  std::list<std::shared_ptr<Running>> running_;
  std::vector<std::thread> threads_;
  std::thread heartbeat_;
  std::stop_callback<std::function<void()>> asked_;  // the first to go
};

}  // namespace kvx
