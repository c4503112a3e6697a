// Webhooks and their outbox: a message is written in the transaction that ends a job,
// and sent until somebody takes it.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "storage/database/database.h"
#include "storage/page.h"
#include "storage/project.h"

namespace kvx {

struct Webhook {
  int64_t seq = 0;
  std::string id, url, secret;  // the secret as in "whsec_<base64>"
  std::string events;           // JSON list of types: "job.succeeded", "job.failed", "job.cancelled"
  int64_t created_ms = 0;
};

struct WebhookMessage {
  std::string id, url, secret, type, body;
  int64_t attempt = 0;  // that failed before
  std::string project;
};

struct WebhookDelivery {
  std::string id, type, state;  // waiting, delivered, given_up
  int64_t attempt = 0, next_ms = 0, created_ms = 0;
  std::string answer;  // what came of the last attempt, in our words
};

constexpr int kMostWebhooks = 20;                // of a project
constexpr int64_t kLongestPostponedMs = kDayMs;  // of one message

class WebhookOutbox {
 public:
  explicit WebhookOutbox(Database& db, ProjectFilter project = {}) : db_(db), project_(std::move(project)) {}
  WebhookOutbox ForProject(const std::string& project) const { return WebhookOutbox(db_, project); }

  // Throws Conflict when the project has kMostWebhooks.
  Webhook Add(const std::string& url, const std::string& secret, const std::string& events);
  Webhook Require(const std::string& id);  // throws NotFound
  void Remove(const std::string& id);      // its waiting messages too; throws NotFound
  Page<Webhook> List(const PageRequest& page);
  std::vector<WebhookDelivery> Deliveries(const std::string& webhook, int limit);  // newest first

  // Of the project whose turn is after `after`, the message that has been due longest. Due means now or
  // earlier.
  std::optional<WebhookMessage> NextDue(const std::string& after = "");
  void Delivered(const std::string& message, const std::string& answer);
  // By kLongestPostponedMs at most.
  void Postpone(const std::string& message, int64_t delay_ms, const std::string& answer);
  void GiveUp(const std::string& message, const std::string& answer);
  void ForgetOlderThan(int64_t age_ms);  // messages that are delivered or given up
  // What waits for a time of a clock that was set back since waits no longer than a message can.
  void PullInWaiting();

 private:
  void Settle(const std::string& message, const char* state, int64_t next_ms, const std::string& answer);
  Database& db_;
  ProjectFilter project_;
};

}  // namespace kvx
