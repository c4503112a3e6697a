// A stage has ended when the job's next event tells of another one, or of the job's end.
#include "server/jobs/job_watch.h"

namespace kvx {
namespace {

constexpr int kEventsAtOnce = 1000;

// "register pose01" -> "register": what it is about is not the stage's name.
std::string StageName(const std::string& stage) { return stage.substr(0, stage.find(' ')); }

}  // namespace

JobWatch::JobWatch(JobQueue& jobs, Metrics& metrics)
    : jobs_(jobs), metrics_(metrics), seen_(jobs.LastEventOfAll()) {}

void JobWatch::Look() {
  const std::lock_guard lock(mutex_);
  while (true) {
    const std::vector<JobEvent> events = jobs_.EventsOfAllAfter(seen_, kEventsAtOnce);
    for (const JobEvent& event : events) Take(event);
    if (!events.empty()) seen_ = events.back().id;
    if (int(events.size()) < kEventsAtOnce) return;
  }
}

void JobWatch::Take(const JobEvent& event) {
  Stage& stage = running_[event.job];
  const bool goes_on = event.state == "running" && event.stage == stage.name;
  if (!stage.name.empty() && !goes_on) {
    metrics_.stages.Observe("stage=\"" + StageName(stage.name) + "\"",
                            double(event.at_ms - stage.began_ms) / 1000);
  }
  if (event.state == "running") {
    if (!goes_on) stage = {event.stage, event.at_ms};
    return;
  }
  running_.erase(event.job);
  metrics_.jobs_succeeded += event.state == "succeeded";
  metrics_.jobs_failed += event.state == "failed";
  metrics_.jobs_cancelled += event.state == "cancelled";
}

}  // namespace kvx
