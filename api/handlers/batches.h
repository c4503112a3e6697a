// Batches: many models asked for at once, followed and cancelled as one.
#pragma once
#include "api/request.h"
#include "api/services.h"

namespace kvx {

// POST /v1/batches {models: [as POST /v1/models, ...], keys?, name?, priority?}: all of them are accepted, or
// none. `keys` are Idempotency-Keys of the models: what was asked for under one before is not made again.
Answer CreateBatch(Services& services, const std::string& body, const std::string& idempotency_key);
std::string ListBatches(Services& services, const Query& query);
std::string GetBatch(Services& services, const std::string& id);  // counts by state, and every job
std::string CancelBatch(Services& services,
                        const std::string& id);  // what has not ended yet; Conflict when all has

}  // namespace kvx
