// Sends the outbox: Standard Webhooks (id, timestamp, HMAC),
// retried with back-off, and to public addresses alone.
#pragma once
#include <netinet/in.h>

#include <atomic>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "storage/webhook_outbox.h"

namespace kvx {

struct WebhookOptions {
  // Loopback, private and link-local ones, where others' services may lie
  bool allow_private_addresses = false;
  int timeout_seconds = 10;
};

// A few threads, of which one at a time sends for a project; projects take turns. A service that is killed
// sends again what it had not noted as delivered, under the same id.
class WebhookSender {
 public:
  WebhookSender(WebhookOutbox& outbox, const WebhookOptions& options);
  ~WebhookSender() { Stop(); }
  void Stop();

 private:
  void Run();
  bool SendOne();
  std::optional<WebhookMessage> Take();  // of a project that nobody sends for until it is given back
  void GiveBack(const std::string& project);
  WebhookOutbox& outbox_;
  WebhookOptions options_;
  std::atomic<bool> stopping_{false};
  std::mutex mutex_;
  std::string served_last_;         // a project
  std::set<std::string> sent_for_;  // projects, at the moment
  std::vector<std::thread> threads_;
};

// "v1,<base64 of HMAC-SHA-256 over id.timestamp.body>"; the secret is "whsec_<base64>".
std::string WebhookSignature(const std::string& secret, const std::string& id, int64_t timestamp,
                             const std::string& body);
bool IsPublicAddress(const sockaddr& address);
// Seconds to wait after the given number of failed attempts; 0: give up.
int64_t WebhookDelaySeconds(int64_t failed_attempts);

}  // namespace kvx
