// Who writes a file holds a lock on it, which tells in whatever container it runs.
#include "pipeline/artifacts/leftovers.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <ctime>
#include <string>
#include <string_view>

namespace kvx {
namespace {

constexpr std::string_view kEnding = ".kva";

// KEY.kva.PROCESS.RANDOM
bool IsTemporary(const std::string& name) {
  const size_t at = name.find(kEnding);
  return at != name.npos && name.find_first_not_of("0123456789.", at + kEnding.size()) == name.npos &&
         name.size() > at + kEnding.size();
}

// Nobody writes it: its process is gone, or its number another's after a day.
bool IsLeft(const std::filesystem::path& temporary) {
  struct stat status;
  if (::stat(temporary.c_str(), &status) != 0) return false;
  const std::string name = temporary.filename().string();
  const pid_t process = pid_t(std::atoi(name.c_str() + name.find(kEnding) + kEnding.size() + 1));
  const bool gone = process > 0 && ::kill(process, 0) != 0 && errno == ESRCH;
  if (!gone && std::time(nullptr) - status.st_mtime < 24 * 3600) return false;
  const int file = ::open(temporary.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool unlocked = ::flock(file, LOCK_EX | LOCK_NB) == 0;
  ::close(file);
  return unlocked;
}

}  // namespace

void RemoveLeftovers(const std::filesystem::path& artifacts) {
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator entry(artifacts, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;
    if (IsTemporary(entry->path().filename().string()) && IsLeft(entry->path()))
      std::filesystem::remove(entry->path(), ignored);
  }
}

}  // namespace kvx
