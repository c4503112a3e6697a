// hash = SHA-256(hash before, time, who, project, action, object, outcome), each with its length.
#include "storage/audit.h"

#include "core/digest.h"
#include "storage/database/sqlite.h"

namespace kvx {
namespace {

constexpr int kVerifyChunk = 1000;

AuditRecord AuditRow(SQLite::Statement& row) {
  return {sqlite::Integer(row, 0),
          sqlite::Integer(row, 1),
          {sqlite::Text(row, 2), sqlite::Text(row, 3), sqlite::Text(row, 4), sqlite::Text(row, 5),
           sqlite::Text(row, 6)},
          sqlite::Text(row, 7)};
}

std::string HashOf(const std::string& before, int64_t at_ms, const AuditEntry& e) {
  Hasher hasher;
  hasher.Add("kinevox audit").Add(before).Add(at_ms);
  return hasher.Add(e.who).Add(e.project).Add(e.action).Add(e.object).Add(e.outcome).Finish().Hex();
}

std::string Text0(SQLite::Statement& row) { return sqlite::Text(row, 0); }

}  // namespace

void AuditTrail::Append(const AuditEntry& entry) {
  db_.Write([&](SQLite::Database& db) {
    const int64_t now = db_.NowMs();
    const std::string before = sqlite::One(db, "last_audit_hash", Text0).value_or("");
    sqlite::Execute(db, "insert_audit", now, entry.who, entry.project, entry.action, entry.object,
                    entry.outcome, HashOf(before, now, entry));
  });
}

Page<AuditRecord> AuditTrail::List(const PageRequest& page) {
  return db_.Read([&](SQLite::Database& db) {
    return MakePage(
        page, [&](int rows) { return sqlite::All(db, "page_audit", AuditRow, page.before, rows, project_); });
  });
}

AuditCheck AuditTrail::Verify(const std::string& earlier_head) {
  AuditCheck check;
  check.knows_head = earlier_head.empty();
  return db_.Read([&](SQLite::Database& db) {
    int64_t last = 0;
    while (true) {
      const auto records = sqlite::All(db, "list_audit", AuditRow, last, kVerifyChunk);
      if (records.empty()) return check;
      for (const AuditRecord& record : records) {
        const bool follows =
            record.seq == last + 1 && record.hash == HashOf(check.head, record.at_ms, record.entry);
        if (!follows) {
          check.broken_at = record.seq;
          return check;
        }
        check.head = record.hash;
        check.knows_head = check.knows_head || check.head == earlier_head;
        last = record.seq;
        ++check.entries;
      }
    }
  });
}

}  // namespace kvx
