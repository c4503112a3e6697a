// Models: asked for here, built by a worker as a job.
#pragma once
#include "api/request.h"
#include "api/services.h"

namespace kvx {

// A model that has been checked, not yet submitted.
struct PreparedModel {
  std::string id, subject, template_scan;
  std::string stored;  // what the worker runs
  int priority = 0;
  int64_t need_bytes = 0;
  double work = 0;
};
PreparedModel PrepareModel(Services& services, const Json& request, int otherwise_priority = 0);
JobRecord SubmitModel(Services& services, const PreparedModel& model,
                      const std::optional<std::string>& batch = {});
int PriorityOf(const Json& request, int otherwise = 0);
// What an Idempotency-Key stands for where one model is asked for, and what is kept under it.
RequestKey ModelKey(const std::string& idempotency_key, std::string_view request);
Answer AnswerOf(const PreparedModel& model, const JobRecord& job);

Answer CreateModel(Services& services, const std::string& body, const std::string& idempotency_key);
// Query: cursor, limit; subject: of this one alone, which must be there.
std::string ListModels(Services& services, const Query& query);
std::string GetModel(Services& services,
                     const std::string& id);  // as `kinevox info --json`, with id, job and state

// What the worker runs: the request as CreateModel stored it, files by blob.
BuildTask TaskOf(const BlobStore& blobs, const std::string& model, const std::string& stored_request);

}  // namespace kvx
