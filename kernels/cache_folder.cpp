// A home folder that can be written to, or one of mode 0700 that belongs to this user.
#include "kernels/cache_folder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <optional>
#include <string>

namespace kvx {
namespace {

using std::filesystem::path;

bool MayWrite(const path& folder) { return ::access(folder.c_str(), W_OK) == 0; }

// A service account's may not be there, or not be its to write.
std::optional<path> CacheOfHome() {
  const char* home = std::getenv("HOME");
  if (!home) return std::nullopt;
  const path cache = path(home) / ".cache";
  if (MayWrite(cache) || (!std::filesystem::exists(cache) && MayWrite(home))) return cache;
  return std::nullopt;
}

path OwnTemporaryFolder() {
  std::error_code error;
  const path shared = std::filesystem::temp_directory_path(error);
  if (error) return {};
  const path own = shared / ("kinevox-kernels-" + std::to_string(::getuid()));
  ::mkdir(own.c_str(), 0700);
  struct stat found {};
  const bool mine = ::lstat(own.c_str(), &found) == 0 && S_ISDIR(found.st_mode) &&
                    found.st_uid == ::getuid() && (found.st_mode & 077) == 0;
  return mine ? own : path();
}

}  // namespace

path DefaultProgramFolder() {
  if (const char* folder = std::getenv("KVX_KERNEL_CACHE")) return folder;
  if (const char* cache = std::getenv("XDG_CACHE_HOME")) return path(cache) / "kinevox/kernels";
  if (const auto cache = CacheOfHome()) return *cache / "kinevox/kernels";
  const path own = OwnTemporaryFolder();
  return own.empty() ? own : own / "kinevox/kernels";
}

void GivePoclAFolder() {
  if (std::getenv("POCL_CACHE_DIR") || std::getenv("XDG_CACHE_HOME") || CacheOfHome()) return;
  const path own = OwnTemporaryFolder();
  if (!own.empty()) ::setenv("POCL_CACHE_DIR", (own / "pocl").c_str(), 0);
}

}  // namespace kvx
