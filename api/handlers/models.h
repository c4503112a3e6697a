// Models: asked for here, built by a worker as a job.
#pragma once
#include "api/request.h"
#include "api/services.h"

namespace kvx {

Answer CreateModel(Services& services, const std::string& body, const std::string& idempotency_key);
std::string ListModels(Services& services, const Query& query);
std::string GetModel(Services& services, const std::string& id);  // as `kinevox info --json`, with id, job and state

// What the worker runs: the request as CreateModel stored it, files by blob.
BuildTask TaskOf(const BlobStore& blobs, const std::string& model, const std::string& stored_request);

}  // namespace kvx
