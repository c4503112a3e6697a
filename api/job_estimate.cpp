// Seconds per unit of work are the median of the last runs;
// within a run, the last one's stages say how time goes with progress.
#include "api/job_estimate.h"

#include <algorithm>

#include "core/numbers/quantile.h"

namespace kvx {
namespace {

constexpr int kRuns = 9;

struct Experience {
  double seconds_per_work = 0;
  std::vector<StageTime> last_run;
};

std::optional<Experience> ExperienceOf(JobQueue& jobs, const std::string& kind) {
  const std::vector<std::vector<StageTime>> runs = jobs.RecentRuns(kind, kRuns);  // newest first
  std::vector<double> rates;
  for (const auto& run : runs) {
    double seconds = 0;
    for (const StageTime& stage : run) seconds += stage.seconds;
    if (!run.empty() && run[0].work > 0) rates.push_back(seconds / run[0].work);
  }
  if (rates.empty()) return std::nullopt;
  return Experience{TakeMedian(rates), runs[0]};
}

double SecondsLeft(const Experience& known, const JobRecord& job) {
  const double whole = known.seconds_per_work * job.work;
  return job.state == "queued" ? whole : whole * (1 - ShareOfTime(known.last_run, job.progress));
}

}  // namespace

double ShareOfTime(const std::vector<StageTime>& stages, double fraction) {
  double passed = 0, whole = 0;
  for (size_t i = 0; i < stages.size(); ++i) {
    const double begin = stages[i].begin, end = i + 1 < stages.size() ? stages[i + 1].begin : 1.0;
    const double part =
        end > begin ? std::clamp((fraction - begin) / (end - begin), 0.0, 1.0) : double(fraction >= end);
    whole += stages[i].seconds;
    passed += part * stages[i].seconds;
  }
  return whole > 0 ? passed / whole : fraction;
}

JobEstimate EstimateOf(JobQueue& jobs, const JobRecord& job) {
  JobEstimate estimate;
  if (job.Ended()) return estimate;
  const auto own = ExperienceOf(jobs, job.kind);
  if (own && job.work > 0) estimate.seconds_left = SecondsLeft(*own, job);
  if (job.state != "queued") return estimate;
  // Running ones, and those that are claimed earlier
  const std::vector<JobRecord> before = jobs.BeforeInLine(job);
  int64_t position = 1;
  double seconds_before = 0, running = 0;
  for (const JobRecord& other : before) {
    if (other.state == "queued")
      ++position;
    else
      ++running;
    const auto known = other.kind == job.kind ? own : ExperienceOf(jobs, other.kind);
    if (!known || other.work <= 0)
      estimate.seconds_left.reset();
    else
      seconds_before += SecondsLeft(*known, other);
  }
  estimate.queue_position = position;
  if (estimate.seconds_left)
    *estimate.seconds_left += seconds_before / std::max(1.0, running);  // workers share what is before it
  return estimate;
}

}  // namespace kvx
