// Jobs: how far they are, and the wish that they stop.
#pragma once
#include "api/request.h"
#include "api/services.h"

namespace kvx {

std::string ListJobs(Services& services, const Query& query);
std::string GetJob(Services& services, const std::string& id);
// For a long poll: the job, and whether anything has happened to it after the event.
struct JobLook {
  std::string text;
  int64_t last_event = 0;
  bool changed = false;
};
JobLook LookAtJob(Services& services, const std::string& id, int64_t after);
std::string CancelJob(Services& services, const std::string& id);  // Conflict when it has ended

// One server-sent event per change; `last` is the id of the last one sent.
struct EventBatch {
  std::string text;  // as it goes over the wire; empty when nothing happened
  int64_t last = 0;
  bool ended = false;
};
EventBatch NextEvents(Services& services, const std::string& id, int64_t after);

}  // namespace kvx
