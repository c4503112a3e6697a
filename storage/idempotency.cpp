// One write transaction holds the look-up, the work and the record:
// two requests with one key cannot both run.
#include "storage/idempotency.h"

#include "core/errors.h"
#include "storage/database/sqlite.h"

namespace kvx {
namespace {

struct Found {
  std::string request_digest;
  KeptAnswer answer;
};

Found FoundRow(SQLite::Statement& row) {
  return {sqlite::Text(row, 0), {int(sqlite::Integer(row, 1)), sqlite::Text(row, 2), sqlite::Text(row, 3)}};
}

}  // namespace

// A key of another project is another key.
std::string Idempotency::ScopeOf(const RequestKey& key) const {
  return ProjectOfNew(project_) + " " + key.scope;
}

std::optional<KeptAnswer> Idempotency::Find(const RequestKey& key) {
  if (key.key.empty()) return std::nullopt;
  return db_.Read([&](SQLite::Database& db) -> std::optional<KeptAnswer> {
    auto found = sqlite::One(db, "find_idempotent", FoundRow, ScopeOf(key), key.key);
    if (!found) return std::nullopt;
    if (found->request_digest != key.request.Hex()) {
      throw Conflict("this Idempotency-Key came before with another request; use a new key");
    }
    return found->answer;
  });
}

KeptAnswer Idempotency::Once(const RequestKey& key, const std::function<KeptAnswer()>& make) {
  return db_.Write([&](SQLite::Database& db) {
    if (auto found = Find(key)) return *found;
    const KeptAnswer answer = make();
    if (key.key.empty()) return answer;
    sqlite::Execute(db, "insert_idempotent", ScopeOf(key), key.key, key.request.Hex(), answer.status,
                    answer.location, answer.body, db_.NowMs());
    return answer;
  });
}

void Idempotency::ForgetOlderThan(int64_t age_ms) {
  db_.Write([&](SQLite::Database& db) { sqlite::Execute(db, "forget_idempotent", db_.NowMs() - age_ms); });
}

}  // namespace kvx
