// What becomes of jobs and how long their stages take, as metrics: read from the events of all jobs, so that
// it does not matter which process works on them.
#pragma once
#include <map>
#include <mutex>
#include <string>

#include "server/metrics.h"
#include "storage/job_queue.h"

namespace kvx {

class JobWatch {
 public:
  // Counts what happens from now on.
  JobWatch(JobQueue& jobs, Metrics& metrics);
  void Look();

 private:
  struct Stage {
    std::string name;
    int64_t began_ms = 0;
  };
  void Take(const JobEvent& event);

  JobQueue& jobs_;
  Metrics& metrics_;
  std::mutex mutex_;
  int64_t seen_ = 0;
  std::map<std::string, Stage> running_;  // by job
};

}  // namespace kvx
