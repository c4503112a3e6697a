// GET /v1/jobs/{j} and its events.
#include "api/handlers/jobs.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "api/job_estimate.h"
#include "api/views.h"
#include "core/errors.h"

namespace kvx {

std::string ListJobs(Services& services, const Query& query) {
  constexpr std::string_view kStates[] = {"queued", "running", "succeeded", "failed", "cancelled"};
  const PageRequest page = ParsePage(query, "state");
  const std::optional<std::string> state = QueryText(query, "state");
  if (state && std::ranges::find(kStates, *state) == std::end(kStates))
    throw InputError("'state' is queued, running, succeeded, failed or cancelled");
  return Dump(PageView(services.jobs.List(page, state)));
}

namespace {

// One job as it stands, with its place in line, the time it will take,
// and the event that a client has then seen.
Json Whole(Services& services, const JobRecord& job) {
  Json json = View(job);
  const JobEstimate estimate = EstimateOf(services.jobs, job);
  json["queue_position"] = estimate.queue_position ? Json(*estimate.queue_position) : Json();
  json["seconds_left"] = estimate.seconds_left ? Json(std::round(*estimate.seconds_left * 10) / 10) : Json();
  if (job.state == "succeeded") {
    json["stages"] = Json::array();
    for (const StageTime& stage : services.jobs.StagesOf(job.id)) {
      json["stages"].push_back(
          {{"stage", stage.stage}, {"seconds", std::round(stage.seconds * 1000) / 1000}});
    }
  }
  return json;
}

}  // namespace

std::string GetJob(Services& services, const std::string& id) {
  return Dump(Whole(services, services.jobs.Require(id)));
}

JobLook LookAtJob(Services& services, const std::string& id, int64_t after) {
  JobLook look;
  look.last_event = services.jobs.LastEvent(id);  // read before the job: it knows at least as much
  const JobRecord job = services.jobs.Require(id);
  look.changed = look.last_event > after || job.Ended();
  Json json = Whole(services, job);
  json["event"] = look.last_event;
  look.text = Dump(json);
  return look;
}

std::string CancelJob(Services& services, const std::string& id) {
  return Dump(View(services.jobs.Cancel(id)));
}

EventBatch NextEvents(Services& services, const std::string& id, int64_t after) {
  EventBatch batch{"", after, false};
  const auto events = services.jobs.EventsAfter(id, after);
  const JobRecord job = services.jobs.Require(id);  // read after the events: it knows at least as much
  const JobEstimate estimate = events.empty() ? JobEstimate() : EstimateOf(services.jobs, job);
  for (const JobEvent& event : events) {
    Json json = View(job, event);
    if (&event == &events.back() && estimate.queue_position)
      json["queue_position"] = *estimate.queue_position;
    if (&event == &events.back() && estimate.seconds_left)
      json["seconds_left"] = std::round(*estimate.seconds_left * 10) / 10;
    batch.text += "id: " + std::to_string(event.id) + "\nevent: job\ndata: " + Dump(json) + "\n\n";
    batch.last = event.id;
    batch.ended = event.IsLast();
  }
  // A job may end between the two reads: then its last event is still to come.
  if (events.empty()) batch.ended = job.Ended() && services.jobs.LastEvent(id) <= after;
  return batch;
}

}  // namespace kvx
