// Sends the outbox: Standard Webhooks (id, timestamp, HMAC),
// retried with back-off, and to public addresses alone.
#pragma once
#include <netinet/in.h>

#include <atomic>
#include <string>
#include <thread>

#include "storage/webhook_outbox.h"

namespace kvx {

struct WebhookOptions {
  // Loopback, private and link-local ones, where others' services may lie
  bool allow_private_addresses = false;
  int timeout_seconds = 10;
};

// One thread; a service that is killed sends again what it had not noted as delivered, under the same id.
class WebhookSender {
 public:
  WebhookSender(WebhookOutbox& outbox, const WebhookOptions& options);
  ~WebhookSender() { Stop(); }
  void Stop();

 private:
  void Run();
  bool SendOne();
  WebhookOutbox& outbox_;
  WebhookOptions options_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

// "v1,<base64 of HMAC-SHA-256 over id.timestamp.body>"; the secret is "whsec_<base64>".
std::string WebhookSignature(const std::string& secret, const std::string& id, int64_t timestamp,
                             const std::string& body);
bool IsPublicAddress(const sockaddr& address);
// Seconds to wait after the given number of failed attempts; 0: give up.
int64_t WebhookDelaySeconds(int64_t failed_attempts);

}  // namespace kvx
