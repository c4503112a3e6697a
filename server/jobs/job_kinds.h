// The kinds of jobs and what a worker runs for each.
// A new kind is one run function and one line in AllJobKinds.
#pragma once
#include <functional>
#include <map>
#include <string>

#include "api/services.h"

namespace kvx {

struct JobOutcome {
  std::string result;            // a JSON object: the job's `result`
  std::function<void()> record;  // may be empty; writes to the database in the transaction that ends the job
  // What the work takes when nothing of it is found from before; 0: unknown.
  // Time estimates leave out runs that found much.
  double whole_seconds = 0;
};

// The request is the JSON that the job was submitted with. Finished work of an earlier attempt should be
// found, not redone. Reports through `progress`, which throws Cancelled; throws Unavailable for what may
// pass: the job is tried again later. Anything else that it throws fails the job.
using RunJob = std::function<JobOutcome(const ClaimedJob& job, const Progress& progress)>;
using JobKinds = std::map<std::string, RunJob, std::less<>>;

JobKinds AllJobKinds(Services& services);

}  // namespace kvx
