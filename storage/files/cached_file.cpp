// Read by position: those who send one file at the same time share it.
#include "storage/files/cached_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/errors.h"

namespace kvx {

CachedFile::CachedFile(const std::filesystem::path& path)
    : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  struct stat status {};
  if (file_ < 0 || ::fstat(file_, &status) != 0) {
    if (file_ >= 0) ::close(file_);
    throw Unavailable("a computed result cannot be read back; ask again");
  }
  size_ = size_t(status.st_size);
}

CachedFile::~CachedFile() {
  if (file_ >= 0) ::close(file_);
}

size_t CachedFile::ReadAt(size_t offset, char* out, size_t count) const {
  if (file_ < 0) return offset < size_ ? bytes_.copy(out, count, offset) : 0;
  const ssize_t got = ::pread(file_, out, count, off_t(offset));
  if (got < 0) throw Unavailable("a computed result cannot be read back; ask again");
  return size_t(got);
}

}  // namespace kvx
