// fsync takes a file that was opened to be read alone, too.
#include "storage/files/flush_to_disk.h"

#include <fcntl.h>
#include <unistd.h>

namespace kvx {

bool FlushToDisk(const std::filesystem::path& file_or_folder) {
  const int file = ::open(file_or_folder.c_str(), O_RDONLY | O_CLOEXEC);
  const bool flushed = file >= 0 && ::fsync(file) == 0;
  if (file >= 0) ::close(file);
  return flushed;
}

}  // namespace kvx
