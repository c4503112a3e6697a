// The database of a data folder, for commands that work beside a running service: SQLite lets several
// processes in.
#pragma once
#include <filesystem>

#include "core/errors.h"
#include "storage/data_folder.h"

namespace kvx {

inline std::filesystem::path DatabaseOf(const std::filesystem::path& data, bool make) {
  const std::filesystem::path file = data / kDatabaseFile;
  std::error_code error;
  if (make) std::filesystem::create_directories(data, error);
  if (!make && !std::filesystem::exists(file))
    throw NotFound("this is not a data folder of the service; give it with --data");
  return file;
}

}  // namespace kvx
