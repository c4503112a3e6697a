// Jobs that the service is asked for, under keys made of the question: the same question again gets the jobs
// of then, and new ones for those that did not end well.
#pragma once
#include <exception>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/service/service_client.h"

namespace kvx {

// The next key after one that led to something that is spent.
std::string NextKey(const std::string& key, const std::string& spent_id);

// Under which a model is asked for, alone or among others. `again`: empty, or other models than those of
// before.
std::string KeyOfModel(const std::string& again, const ServiceJson& request);

// One job. Under the same key the answer of before, unless its job has ended and not well, or is gone: then
// a new one.
struct AskedJob {
  ServiceJson answer;
  bool earlier = false;  // the answer of an earlier command
};
AskedJob AskForJob(ServiceClient& client, const std::string& path, const ServiceJson& body, std::string key);

// Models, one for each of `requests` (what POST /v1/models takes), in their order: {"id", "job", "state",
// "batch"} and of one that has ended "result" or "error", or {"state": "failed", "error"} where the service
// refuses the request; the others go on without it. Those that were asked for before are as they were made
// then, each by itself; what is new becomes a batch, and what is asked for anew, because its job of then is
// spent, another.
struct AskedModels {
  std::vector<ServiceJson> models;
  std::string batch;         // the last that was made, else their newest; empty: the service refused them all
  bool earlier = false;      // all of them are an earlier command's
  std::exception_ptr broke;  // what ended the asking, a full disk or a revoked key; those left are refused
};
AskedModels AskForModels(ServiceClient& client, const std::vector<ServiceJson>& requests,
                         const std::string& again);

// Ids of batches are told from those of jobs by their beginning.
bool IsBatch(const std::string& id);
std::string AddressOf(const std::string& job_or_batch);  // on the service

// Of the `state` that the service tells of a job.
bool Ended(const ServiceJson& state);
bool EndedBadly(const ServiceJson& state);  // failed or cancelled

ServiceJson ProblemOf(const std::string& detail);  // of a study that was not submitted
std::string ReasonOf(const ServiceJson& ended_job);
// What the job says of its study in its result.
std::vector<std::string> WarningsOf(const ServiceJson& ended_job);
std::string CountedWarnings(size_t warnings);                                    // "3 warnings"; empty: none
void TellWarnings(const ServiceJson& ended_job, const std::string& about = {});  // before each

}  // namespace kvx
