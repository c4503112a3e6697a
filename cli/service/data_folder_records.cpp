// A data folder is known by its database, or by the lock that a service makes before it.
#include "cli/service/data_folder_records.h"

#include <cstdio>

#include "core/errors.h"
#include "storage/files/data_folder.h"

namespace kvx {
namespace {

constexpr char kNotOne[] =
    " is not a data folder of the service; give the folder of 'kinevox serve' with --data";

}  // namespace

void RequireDataFolderOrEmpty(const std::filesystem::path& data) {
  if (IsDataFolder(data)) return;
  std::error_code ignored;
  const bool other = std::filesystem::exists(data, ignored) && !std::filesystem::is_directory(data, ignored);
  if (other || !HoldsNothing(data))
    throw NotFound(data.string() +
                   " holds other things and is not a data folder of the service; give "
                   "another with --data, a new or empty one for a new service");
}

void RequireDataFolder(const std::filesystem::path& data) {
  if (!IsDataFolder(data)) throw NotFound(data.string() + kNotOne);
}

std::filesystem::path DatabaseOf(const std::filesystem::path& data) {
  if (!std::filesystem::exists(data / kDatabaseFile)) throw NotFound(data.string() + kNotOne);
  return data / kDatabaseFile;
}

std::filesystem::path DatabaseOfMaybeNew(const std::filesystem::path& data) {
  RequireDataFolderOrEmpty(data);
  if (!IsDataFolder(data)) std::fprintf(stderr, "%s becomes a new data folder\n", data.c_str());
  MakePrivate(data);
  return data / kDatabaseFile;
}

}  // namespace kvx
