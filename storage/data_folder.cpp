// flock(2): released by the kernel however the process ends.
#include "storage/data_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "core/errors.h"

namespace kvx {

DataFolder::DataFolder(const std::filesystem::path& root) : root_(root) {
  std::error_code error;
  std::filesystem::create_directories(root_, error);
  root_ = std::filesystem::absolute(root_);
  lock_ = ::open((root_ / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (lock_ < 0) throw Unavailable("the data folder cannot be written; give another with --data");
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    ::close(lock_);
    throw Conflict("another kinevox service uses this data folder; stop it or give another folder with --data");
  }
  std::filesystem::remove_all(work(), error);
  for (const auto& folder : {work(), artifacts(), results(), root_ / "models"}) {
    std::filesystem::create_directories(folder, error);
    if (error) throw Unavailable("the data folder cannot be written; give another with --data");
  }
}

DataFolder::~DataFolder() { ::close(lock_); }

uintmax_t DataFolder::FreeBytes() const {
  std::error_code error;
  const auto space = std::filesystem::space(root_, error);
  return error ? 0 : space.available;
}

}  // namespace kvx
