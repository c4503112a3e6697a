// API keys: who may do what, in which project, how much.
// A key is shown once, when it is made; kept is its hash.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "storage/database/database.h"

namespace kvx {

enum class AccessScope { kRead = 1, kWrite = 2, kAdmin = 3 };  // each holds the ones before it
std::string_view NameOf(AccessScope scope);
AccessScope ParseScope(std::string_view name);  // throws InputError

struct Quota {
  std::optional<int64_t> requests_per_minute, bytes_per_day;  // absent: the service's default
};

struct ApiKeyRecord {
  std::string id, name, project;
  AccessScope scope = AccessScope::kRead;
  std::string secret_sha256;
  Quota quota;
  int64_t created_ms = 0;
  std::optional<int64_t> expires_ms, revoked_ms;
};

struct NewApiKey {
  std::string name, project;
  AccessScope scope = AccessScope::kWrite;
  Quota quota;
  std::optional<int64_t> lifetime_ms;
};

class ApiKeys {
 public:
  explicit ApiKeys(Database& db) : db_(db) {}

  struct Made {
    ApiKeyRecord record;
    std::string text;  // "kvx.<id>.<secret>": what the client sends as its bearer token
  };
  Made Add(const NewApiKey& key);
  std::vector<ApiKeyRecord> List();
  ApiKeyRecord Revoke(const std::string& id);  // throws NotFound
  // The key that the text is, if it is one that counts now.
  std::optional<ApiKeyRecord> Check(std::string_view text);

  // Uploaded bytes of today (UTC). False, and nothing added, where that would be more than `most`.
  bool AddBytes(const std::string& who, int64_t bytes, int64_t most);
  int64_t BytesToday(const std::string& who);

 private:
  Database& db_;
};

}  // namespace kvx
