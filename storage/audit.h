// The audit trail: who did what to which id, when, and how it ended. Never names, paths or contents. Only
// appended; each entry's hash covers the one before.
#pragma once
#include <optional>
#include <string>

#include "storage/database/database.h"
#include "storage/page.h"
#include "storage/project.h"

namespace kvx {

struct AuditEntry {
  std::string
      who;  // id of an API key, "oidc:<subject>", "local" (no authentication), "command line", "-" (refused)
  std::string project;
  std::string action;   // "POST /v1/models", "keys revoke"
  std::string object;   // our ids, space between
  std::string outcome;  // HTTP status or "done"
};

struct AuditRecord {
  int64_t seq = 0, at_ms = 0;
  AuditEntry entry;
  std::string hash;
};

struct AuditCheck {
  int64_t entries = 0;
  std::string head;  // hash of the last entry; kept elsewhere, it proves that nothing was cut off
  std::optional<int64_t> broken_at;  // seq of the first entry that does not follow from the one before
  bool knows_head = true;            // the head that was asked for is in the trail
};

class AuditTrail {
 public:
  explicit AuditTrail(Database& db, ProjectFilter project = {}) : db_(db), project_(std::move(project)) {}
  AuditTrail ForProject(const std::string& project) const { return AuditTrail(db_, project); }
  void Append(const AuditEntry& entry);  // joins the transaction of this thread, where there is one
  Page<AuditRecord> List(const PageRequest& page);
  AuditCheck Verify(const std::string& earlier_head = "");

 private:
  Database& db_;
  ProjectFilter project_;
};

}  // namespace kvx
