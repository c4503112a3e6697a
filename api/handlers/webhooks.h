// Webhooks: where the ends of jobs are told, signed as Standard Webhooks says.
#pragma once
#include "api/request.h"
#include "api/services.h"

namespace kvx {

// POST /v1/webhooks {url, events?, secret?}; the answer is the only one that holds the secret.
Answer CreateWebhook(Services& services, const std::string& body, const std::string& idempotency_key);
std::string ListWebhooks(Services& services, const Query& query);
std::string GetWebhook(Services& services, const std::string& id);  // with its last deliveries
void RemoveWebhook(Services& services, const std::string& id);

}  // namespace kvx
