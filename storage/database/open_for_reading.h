// A database file opened to be read alone, on a read-only file system too: a snapshot of a data folder.
#pragma once
#include <SQLiteCpp/SQLiteCpp.h>

#include <filesystem>
#include <memory>

namespace kvx {

constexpr int kBusyTimeoutMs = 5000;  // of every connexion: another may be writing

bool OnReadOnlyDisk(const std::filesystem::path& file);  // as it is mounted here

// Throws SQLite::Exception. Throws Unavailable where the disk is read-only and the database was in use when
// it became so: its last changes lie in a file beside it that cannot be read without being written to.
std::unique_ptr<SQLite::Database> OpenForReading(const std::filesystem::path& file);

}  // namespace kvx
