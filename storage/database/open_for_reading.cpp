// A database in write-ahead mode is read with the help of a file beside it, unless nothing changes it:
// https://www.sqlite.org/wal.html#read_only_databases
#include "storage/database/open_for_reading.h"

#include <sys/statvfs.h>

#include "core/errors.h"

namespace kvx {
namespace {

// https://www.sqlite.org/uri.html
std::string UriOf(const std::filesystem::path& file) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(file).string()) {
    if (c == '?')
      uri += "%3f";
    else if (c == '#')
      uri += "%23";
    else if (c == '%')
      uri += "%25";
    else
      uri += c;
  }
  return uri;
}

bool HoldsBytes(const std::filesystem::path& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  return !error && size > 0;
}

}  // namespace

bool OnReadOnlyDisk(const std::filesystem::path& file) {
  struct statvfs disk {};
  return ::statvfs(file.c_str(), &disk) == 0 && (disk.f_flag & ST_RDONLY) != 0;
}

std::unique_ptr<SQLite::Database> OpenForReading(const std::filesystem::path& file) {
  if (!OnReadOnlyDisk(file))
    return std::make_unique<SQLite::Database>(file.string(), SQLite::OPEN_READONLY, kBusyTimeoutMs);
  if (HoldsBytes(file.string() + "-wal"))
    throw Unavailable(
        "the data folder is read-only, and its database was in use when it became so; copy the whole folder "
        "to where it can be written, and give the copy");
  return std::make_unique<SQLite::Database>(UriOf(file) + "?immutable=1",
                                            SQLite::OPEN_READONLY | SQLite::OPEN_URI, kBusyTimeoutMs);
}

}  // namespace kvx
