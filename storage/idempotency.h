// Answers kept by Idempotency-Key, in the same transaction as what they report.
#pragma once
#include <functional>
#include <optional>
#include <string>

#include "core/digest.h"
#include "storage/database/database.h"
#include "storage/project.h"

namespace kvx {

struct KeptAnswer {
  int status = 200;
  std::string location;
  std::string body;
};

// What an Idempotency-Key stands for.
struct RequestKey {
  std::string scope;  // method and path
  std::string key;    // empty: nothing is remembered
  Digest request;     // of everything that shapes the answer
};

class Idempotency {
 public:
  explicit Idempotency(Database& db, ProjectFilter project = {}) : db_(db), project_(std::move(project)) {}
  Idempotency ForProject(const std::string& project) const { return Idempotency(db_, project); }

  // Runs `make` once per key. The same request again gets the same answer;
  // another request under the key throws Conflict.
  KeptAnswer Once(const RequestKey& key, const std::function<KeptAnswer()>& make);
  // What the key was answered before, if it was. Throws Conflict like Once.
  std::optional<KeptAnswer> Find(const RequestKey& key);
  void ForgetOlderThan(int64_t age_ms);

 private:
  std::string ScopeOf(const RequestKey& key) const;
  Database& db_;
  ProjectFilter project_;
};

}  // namespace kvx
