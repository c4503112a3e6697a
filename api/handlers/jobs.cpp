// GET /v1/jobs/{j} and its events.
#include "api/handlers/jobs.h"

#include <nlohmann/json.hpp>

#include "api/views.h"

namespace kvx {

std::string ListJobs(Services& services, const Query& query) {
  return Dump(PageView(services.jobs.List(ParsePage(query))));
}

std::string GetJob(Services& services, const std::string& id) { return Dump(View(services.jobs.Require(id))); }

std::string CancelJob(Services& services, const std::string& id) { return Dump(View(services.jobs.Cancel(id))); }

EventBatch NextEvents(Services& services, const std::string& id, int64_t after) {
  EventBatch batch{"", after, false};
  const auto events = services.jobs.EventsAfter(id, after);
  const JobRecord job = services.jobs.Require(id);  // read after the events: it knows at least as much
  for (const JobEvent& event : events) {
    batch.text += "id: " + std::to_string(event.id) + "\nevent: job\ndata: " + Dump(View(job, event)) + "\n\n";
    batch.last = event.id;
    batch.ended = event.state != "queued" && event.state != "running";
  }
  if (events.empty()) batch.ended = job.Ended();
  return batch;
}

}  // namespace kvx
