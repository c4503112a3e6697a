// flock(2): released by the kernel however the process ends.
#include "storage/data_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "core/errors.h"

namespace kvx {

namespace {

constexpr char kNotWritable[] = "the data folder cannot be written; give another with --data";

int OpenLock(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0) throw Unavailable(kNotWritable);
  return file;
}

}  // namespace

DataFolder::DataFolder(const std::filesystem::path& root, Use use) : root_(root) {
  std::error_code error;
  std::filesystem::create_directories(root_, error);
  root_ = std::filesystem::absolute(root_);
  workers_ = OpenLock(root_ / "workers.lock");
  if (use == Use::kService) {
    lock_ = OpenLock(root_ / "lock");
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
      ::close(lock_);
      ::close(workers_);
      throw Conflict(
          "another kinevox service uses this data folder; stop it or give another folder with --data");
    }
    alone_ = ::flock(workers_, LOCK_EX | LOCK_NB) == 0;
    if (alone_) std::filesystem::remove_all(work(), error);
  }
  for (const auto& folder : {work(), artifacts(), results(), uploads(), root_ / "models"}) {
    std::filesystem::create_directories(folder, error);
    if (error) throw Unavailable(kNotWritable);
  }
  // Workers that start meanwhile wait here until the service calls LetWorkersIn.
  if (use == Use::kWorker) ::flock(workers_, LOCK_SH);
}

DataFolder::~DataFolder() {
  ::close(workers_);
  if (lock_ >= 0) ::close(lock_);
}

void DataFolder::LetWorkersIn() { ::flock(workers_, LOCK_SH); }

uintmax_t DataFolder::FreeBytes() const {
  std::error_code error;
  const auto space = std::filesystem::space(root_, error);
  return error ? 0 : space.available;
}

}  // namespace kvx
