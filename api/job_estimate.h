// How long a job will still take, from what jobs of its kind took before.
#pragma once
#include <optional>

#include "storage/job_queue.h"

namespace kvx {

struct JobEstimate {
  std::optional<int64_t> queue_position;  // 1: next; absent unless queued
  std::optional<double>
      seconds_left;  // to its end; absent while nothing is known of its kind, or when it has ended
};

JobEstimate EstimateOf(JobQueue& jobs, const JobRecord& job);

// The share of a run's time that has passed when it reports `fraction`, by the measured stages of an earlier
// run: each began at a fraction and took its seconds.
double ShareOfTime(const std::vector<StageTime>& stages, double fraction);

}  // namespace kvx
