// The database of a data folder or of a backup, and what its records name.
#pragma once
#include <SQLiteCpp/SQLiteCpp.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace kvx {

// Throws Conflict for those of a newer program, and of one so old that this one cannot go through its
// records.
void RequireOfThisKind(SQLite::Database& db);

// As of one moment, without unfinished uploads.
void CopyRecords(const std::filesystem::path& from, const std::filesystem::path& to);

// Uploads, by their digests, and models that were built.
std::set<std::string> NamedBy(const std::filesystem::path& records);

// Ids of the scans, label maps or models that need them.
std::vector<std::string> HoldersOf(const std::set<std::string>& named, const std::filesystem::path& records);

// The audit trail only grows: a data folder whose trail lacks the end of the backup's is another one, or was
// put back to an earlier state.
bool IsOfAnother(const std::filesystem::path& data, const std::filesystem::path& backup);

}  // namespace kvx
