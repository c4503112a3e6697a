// flock(2): released by the kernel however the process ends.
#include "storage/data_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "core/errors.h"

namespace kvx {

namespace {

constexpr char kNotWritable[] = "the data folder cannot be written; give another with --data";

constexpr char kServiceLock[] = "lock", kWorkersLock[] = "workers.lock";

int OpenLock(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0) throw Unavailable(kNotWritable);
  return file;
}

}  // namespace

bool IsDataFolder(const std::filesystem::path& root) {
  std::error_code ignored;
  return std::filesystem::exists(root / kDatabaseFile, ignored) ||
         std::filesystem::exists(root / kWorkersLock, ignored);
}

bool IsLocked(const std::filesystem::path& root) {
  std::error_code ignored;
  return std::filesystem::exists(root / kServiceLock, ignored) ||
         std::filesystem::exists(root / kWorkersLock, ignored);
}

void MakeLocked(const std::filesystem::path& root) { MakePrivateFile(root / kWorkersLock); }

bool HoldsNothing(const std::filesystem::path& folder) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name != "lost+found" && !name.starts_with('.')) return false;
  }
  return true;
}

void MakePrivateFolder(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  if (fs::create_directories(folder)) fs::permissions(folder, fs::perms::owner_all);
}

void MakePrivateFile(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0)
    throw std::filesystem::filesystem_error("open", std::error_code(errno, std::generic_category()));
  ::close(file);
}

// An empty file is an empty database to SQLite, whose other files take its mode.
void MakePrivate(const std::filesystem::path& root) try {
  MakePrivateFolder(root);
  MakePrivateFile(root / kDatabaseFile);
} catch (const std::filesystem::filesystem_error&) {
  throw Unavailable(kNotWritable);
}

DataFolder::DataFolder(const std::filesystem::path& root, Use use) : root_(root) {
  MakePrivate(root_);
  std::error_code error;
  root_ = std::filesystem::absolute(root_);
  workers_ = OpenLock(root_ / kWorkersLock);
  if (use == Use::kService) {
    lock_ = OpenLock(root_ / kServiceLock);
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
      ::close(lock_);
      ::close(workers_);
      throw Conflict(
          "another kinevox service uses this data folder; stop it or give another folder with --data");
    }
    alone_ = ::flock(workers_, LOCK_EX | LOCK_NB) == 0;
    if (alone_) std::filesystem::remove_all(work(), error);
  }
  for (const auto& folder : {work(), artifacts(), results(), uploads(), root_ / "models", root_ / "blobs"})
    MakePrivateFolder(folder);
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
