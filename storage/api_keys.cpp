// "kvx.<id>.<secret>": the id finds the record,
// the secret's hash is compared without telling by its time how much was right.
#include "storage/api_keys.h"

#include <openssl/crypto.h>

#include "core/digest.h"
#include "core/errors.h"
#include "storage/database/sqlite.h"
#include "storage/ids.h"

namespace kvx {
namespace {

constexpr std::string_view kStart = "kvx.";

std::string HashOf(std::string_view secret) { return Sha256(secret).Hex(); }

ApiKeyRecord KeyRow(SQLite::Statement& row) {
  ApiKeyRecord key;
  key.id = sqlite::Text(row, 0);
  key.name = sqlite::Text(row, 1);
  key.project = sqlite::Text(row, 2);
  key.scope = ParseScope(sqlite::Text(row, 3));
  key.secret_sha256 = sqlite::Text(row, 4);
  key.quota = {sqlite::OptionalInteger(row, 5), sqlite::OptionalInteger(row, 6)};
  key.created_ms = sqlite::Integer(row, 7);
  key.expires_ms = sqlite::OptionalInteger(row, 8);
  key.revoked_ms = sqlite::OptionalInteger(row, 9);
  return key;
}

bool SameHash(const std::string& a, const std::string& b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace

std::string_view NameOf(AccessScope scope) {
  switch (scope) {
    case AccessScope::kRead:
      return "read";
    case AccessScope::kWrite:
      return "write";
    case AccessScope::kAdmin:
      return "admin";
  }
  return "";
}

AccessScope ParseScope(std::string_view name) {
  for (const AccessScope scope : {AccessScope::kRead, AccessScope::kWrite, AccessScope::kAdmin}) {
    if (NameOf(scope) == name) return scope;
  }
  throw InputError("a scope is \"read\", \"write\" or \"admin\"");
}

ApiKeys::Made ApiKeys::Add(const NewApiKey& key) {
  const std::string id = NewId("key");
  const std::string secret = NewId("s").substr(2) + NewId("s").substr(2);
  const int64_t now = db_.NowMs();
  std::optional<int64_t> expires;
  if (key.lifetime_ms) expires = now + *key.lifetime_ms;
  return db_.Write([&](SQLite::Database& db) -> Made {
    sqlite::Execute(db, "insert_api_key", id, key.name, key.project, std::string(NameOf(key.scope)),
                    HashOf(secret), key.quota.requests_per_minute, key.quota.bytes_per_day, now, expires);
    return {*sqlite::One(db, "find_api_key", KeyRow, id), std::string(kStart) + id + "." + secret};
  });
}

std::vector<ApiKeyRecord> ApiKeys::List() {
  return db_.Read([](SQLite::Database& db) { return sqlite::All(db, "list_api_keys", KeyRow); });
}

ApiKeyRecord ApiKeys::Revoke(const std::string& id) {
  return db_.Write([&](SQLite::Database& db) {
    if (sqlite::Execute(db, "revoke_api_key", id, db_.NowMs()) == 0)
      throw NotFound("there is no API key of this id");
    return *sqlite::One(db, "find_api_key", KeyRow, id);
  });
}

std::optional<ApiKeyRecord> ApiKeys::Check(std::string_view text) {
  if (!text.starts_with(kStart)) return std::nullopt;
  text.remove_prefix(kStart.size());
  const size_t dot = text.find('.');
  if (dot == text.npos || !LooksLikeId(text.substr(0, dot), "key")) return std::nullopt;
  auto key = db_.Read([&](SQLite::Database& db) {
    return sqlite::One(db, "find_api_key", KeyRow, std::string(text.substr(0, dot)));
  });
  if (!key || !SameHash(HashOf(text.substr(dot + 1)), key->secret_sha256)) return std::nullopt;
  if (key->revoked_ms || (key->expires_ms && *key->expires_ms <= db_.NowMs())) return std::nullopt;
  return key;
}

bool ApiKeys::AddBytes(const std::string& who, int64_t bytes, int64_t most) {
  return db_.Write([&](SQLite::Database& db) {
    if (BytesToday(who) + bytes > most) return false;
    sqlite::Execute(db, "add_quota_use", who, db_.NowMs() / kDayMs, bytes);
    return true;
  });
}

int64_t ApiKeys::BytesToday(const std::string& who) {
  return db_.Read([&](SQLite::Database& db) {
    const auto bytes = [](SQLite::Statement& row) { return sqlite::Integer(row, 0); };
    return sqlite::One(db, "find_quota_use", bytes, who, db_.NowMs() / kDayMs).value_or(0);
  });
}

}  // namespace kvx
