// Messages are put in by insert_job_event's neighbour, enqueue_webhooks.sql (storage/job_queue.cpp).
#include "storage/webhook_outbox.h"

#include <algorithm>

#include "core/errors.h"
#include "storage/database/sqlite.h"
#include "storage/ids.h"

namespace kvx {
namespace {

constexpr int64_t kHoldMs = 60'000;  // others of a receiver that did not take one

using sqlite::Integer;
using sqlite::Text;

Webhook WebhookRow(SQLite::Statement& row) {
  return {Integer(row, 0), Text(row, 1), Text(row, 2), Text(row, 3), Text(row, 4), Integer(row, 5)};
}

WebhookMessage MessageRow(SQLite::Statement& row) {
  return {Text(row, 0), Text(row, 1),    Text(row, 2), Text(row, 3),
          Text(row, 4), Integer(row, 5), Text(row, 6)};
}

int64_t CountRow(SQLite::Statement& row) { return Integer(row, 0); }

WebhookDelivery DeliveryRow(SQLite::Statement& row) {
  return {Text(row, 0),    Text(row, 1),    Text(row, 2), Integer(row, 3),
          Integer(row, 4), Integer(row, 5), Text(row, 6)};
}

}  // namespace

Webhook WebhookOutbox::Add(const std::string& url, const std::string& secret, const std::string& events) {
  return db_.Write([&](SQLite::Database& db) {
    if (sqlite::One(db, "count_webhooks", CountRow, ProjectOfNew(project_)).value_or(0) >= kMostWebhooks)
      throw Conflict("the project has 20 webhooks, which is the most; remove one that is no longer needed");
    const std::string id = NewId("whk");
    sqlite::Execute(db, "insert_webhook", id, url, secret, events, db_.NowMs(), ProjectOfNew(project_));
    return *sqlite::One(db, "find_webhook", WebhookRow, id, project_);
  });
}

Webhook WebhookOutbox::Require(const std::string& id) {
  auto found = db_.Read(
      [&](SQLite::Database& db) { return sqlite::One(db, "find_webhook", WebhookRow, id, project_); });
  if (!found) throw NotFound("there is no such webhook");
  return *std::move(found);
}

void WebhookOutbox::Remove(const std::string& id) {
  db_.Write([&](SQLite::Database& db) {
    if (sqlite::Execute(db, "remove_webhook", id, project_) == 0) throw NotFound("there is no such webhook");
  });
}

Page<Webhook> WebhookOutbox::List(const PageRequest& page) {
  return db_.Read([&](SQLite::Database& db) {
    return MakePage(page, [&](int rows) {
      return sqlite::All(db, "list_webhooks", WebhookRow, page.before, rows, project_);
    });
  });
}

std::vector<WebhookDelivery> WebhookOutbox::Deliveries(const std::string& webhook, int limit) {
  return db_.Read([&](SQLite::Database& db) {
    return sqlite::All(db, "webhook_deliveries", DeliveryRow, webhook, limit);
  });
}

std::optional<WebhookMessage> WebhookOutbox::NextDue(const std::string& after) {
  return db_.Read([&](SQLite::Database& db) {
    return sqlite::One(db, "next_webhook_message", MessageRow, db_.NowMs(), after);
  });
}

void WebhookOutbox::Settle(const std::string& message, const char* state, int64_t next_ms,
                           const std::string& answer) {
  db_.Write([&](SQLite::Database& db) {
    sqlite::Execute(db, "settle_webhook_message", message, state, next_ms, answer);
  });
}

void WebhookOutbox::Delivered(const std::string& message, const std::string& answer) {
  Settle(message, "delivered", db_.NowMs(), answer);
}

void WebhookOutbox::Postpone(const std::string& message, int64_t wanted_ms, const std::string& answer) {
  const int64_t delay_ms = std::min(wanted_ms, kLongestPostponedMs);
  db_.Write([&](SQLite::Database& db) {
    Settle(message, "waiting", db_.NowMs() + delay_ms, answer);
    sqlite::Execute(db, "hold_webhook", message, db_.NowMs() + std::min(delay_ms, kHoldMs));
  });
}

void WebhookOutbox::GiveUp(const std::string& message, const std::string& answer) {
  Settle(message, "given_up", db_.NowMs(), answer);
}

void WebhookOutbox::ForgetOlderThan(int64_t age_ms) {
  db_.Write(
      [&](SQLite::Database& db) { sqlite::Execute(db, "forget_webhook_messages", db_.NowMs() - age_ms); });
}

void WebhookOutbox::PullInWaiting() {
  db_.Write([&](SQLite::Database& db) {
    sqlite::Execute(db, "pull_in_webhook_messages", db_.NowMs() + kHoldMs, db_.NowMs() + kLongestPostponedMs);
  });
}

}  // namespace kvx
