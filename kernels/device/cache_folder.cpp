// A home folder that can be written to, or one of mode 0700 that belongs to this user.
#include "kernels/device/cache_folder.h"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <optional>
#include <string>

#include "core/errors.h"

namespace kvx {
namespace {

using std::filesystem::path;

constexpr uintmax_t kLeastFreeBytes = uintmax_t(16) << 20;  // what all kernels compile to takes a few MiB

bool MayWrite(const path& folder) { return ::access(folder.c_str(), W_OK) == 0; }

// An empty variable names no folder, and PoCL aborts at one.
bool Named(const char* variable) {
  const char* folder = std::getenv(variable);
  return folder && *folder;
}

// A service account's may not be there, or not be its to write.
std::optional<path> CacheOfHome() {
  const char* home = std::getenv("HOME");
  if (!home) return std::nullopt;
  const path cache = path(home) / ".cache";
  std::error_code ignored;  // of a home that may not be entered
  if (MayWrite(cache) || (!std::filesystem::exists(cache, ignored) && MayWrite(home))) return cache;
  return std::nullopt;
}

std::optional<path> UsersCache() {
  return Named("XDG_CACHE_HOME") ? path(std::getenv("XDG_CACHE_HOME")) : CacheOfHome();
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

bool MayKeepIn(const path& folder) {
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  return MayWrite(folder);
}

// A disk that is mounted noexec, or a rule of the machine, refuses what dlopen asks for.
bool MayLoadFrom(const path& folder) {
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  std::string name = folder / "loadable-XXXXXX";
  const int file = ::mkstemp(name.data());
  if (file < 0) return false;
  ::unlink(name.c_str());
  void* const code = ::mmap(nullptr, 1, PROT_READ | PROT_EXEC, MAP_PRIVATE, file, 0);
  ::close(file);
  return code != MAP_FAILED && ::munmap(code, 1) == 0;
}

}  // namespace

path DefaultProgramFolder() {
  if (const char* folder = std::getenv("KVX_KERNEL_CACHE")) return folder;
  if (const auto cache = UsersCache()) return *cache / "kinevox/kernels";
  const path own = OwnTemporaryFolder();
  return own.empty() ? own : own / "kinevox/kernels";
}

void GivePoclAFolder() {
  if (Named("POCL_CACHE_DIR")) return;
  ::unsetenv("POCL_CACHE_DIR");
  if (const auto cache = UsersCache(); cache && MayKeepIn(*cache / "pocl/kcache")) {
    ::setenv("POCL_CACHE_DIR", (*cache / "pocl/kcache").c_str(), 1);
    return;
  }
  const path own = OwnTemporaryFolder();
  if (!own.empty()) ::setenv("POCL_CACHE_DIR", (own / "pocl").c_str(), 1);
}

bool PoclsFolderHasRoom() {
  if (!Named("POCL_CACHE_DIR")) return true;
  std::error_code unknown;
  const auto space = std::filesystem::space(std::getenv("POCL_CACHE_DIR"), unknown);
  return unknown || space.available >= kLeastFreeBytes;
}

void RequirePoclsRoom() {
  if (PoclsFolderHasRoom()) return;
  throw Unavailable(
      "the disk of PoCL's folder (POCL_CACHE_DIR, else in XDG_CACHE_HOME or ~/.cache) is nearly full: "
      "it needs 16 MiB for what it compiles; make room, or name another folder by POCL_CACHE_DIR");
}

void RequirePoclsFolder() {
  if (!Named("POCL_CACHE_DIR") || MayLoadFrom(std::getenv("POCL_CACHE_DIR"))) return RequirePoclsRoom();
  throw Unavailable(
      "PoCL cannot load what it compiles from its folder (POCL_CACHE_DIR, else in XDG_CACHE_HOME or "
      "~/.cache): its disk is mounted noexec, or it is not yours to write to; mount it with exec, or name "
      "another folder by POCL_CACHE_DIR");
}

}  // namespace kvx
