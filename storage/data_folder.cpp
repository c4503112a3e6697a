// flock(2): released by the kernel however the process ends. The workers' lock file says on which start of
// which machine it is held, as leases go by that machine's clock and the database needs one machine's memory;
// whoever finds it free writes that anew, so a restart, a crash or a copy of the folder refuses nobody.
#include "storage/data_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <thread>

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

// The same in all containers of a machine until it is started anew. Empty: not to be known here.
std::string ThisBoot() {
  std::string id;
  std::ifstream("/proc/sys/kernel/random/boot_id") >> id;
  return id;
}

// A disk that is full holds nobody up: what says nothing refuses nobody.
void SayThisBoot(int lock) {
  const std::string id = ThisBoot();
  if (::ftruncate(lock, 0) != 0) throw Unavailable(kNotWritable);
  if (::pwrite(lock, id.data(), id.size(), 0) == ssize_t(id.size())) return;
  if (::ftruncate(lock, 0) != 0) throw Unavailable(kNotWritable);
}

// Whoever holds the lock is here, as far as can be known: programs of before said nothing.
bool SaysThisBoot(int lock) {
  char text[64];
  const ssize_t size = ::pread(lock, text, sizeof text, 0);
  const std::string id = ThisBoot();
  return size <= 0 || id.empty() || std::string_view(text, size_t(size)) == id;
}

[[noreturn]] void RefuseOtherMachine() {
  throw Conflict(
      "kinevox uses this data folder on another machine, and a service and its workers run on one; stop "
      "what runs there, or start this there");
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
  root_ = std::filesystem::absolute(root_);
  workers_ = OpenLock(root_ / kWorkersLock);
  try {
    if (use == Use::kService) {
      LockForService();
    } else {
      HoldTogether();  // waits until a service that starts meanwhile calls LetWorkersIn
    }
    std::error_code error;
    if (alone_) std::filesystem::remove_all(work(), error);
    for (const auto& folder : {work(), artifacts(), results(), uploads(), root_ / "models", root_ / "blobs"})
      MakePrivateFolder(folder);
  } catch (...) {
    Unlock();
    throw;
  }
}

DataFolder::~DataFolder() { Unlock(); }

void DataFolder::Unlock() {
  ::close(workers_);
  if (lock_ >= 0) ::close(lock_);
}

void DataFolder::LockForService() {
  lock_ = OpenLock(root_ / kServiceLock);
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0)
    throw Conflict(
        "another kinevox service uses this data folder; stop it or give another folder with --data");
  alone_ = TryAlone();
  // A worker that starts has the lock alone for a moment, and then says where it is.
  for (int tries = 0; !alone_ && !SaysThisBoot(workers_); ++tries) {
    if (tries == 10) RefuseOtherMachine();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    alone_ = TryAlone();
  }
}

// False: somebody else holds the workers' lock.
bool DataFolder::TryAlone() {
  if (::flock(workers_, LOCK_EX | LOCK_NB) != 0) return false;
  SayThisBoot(workers_);
  return true;
}

// Between being alone and sharing another may be alone (flock converts in two steps), so what is said is read
// once the lock is shared: from then on nobody writes it.
void DataFolder::HoldTogether() {
  for (int tries = 0; tries < 3; ++tries) {
    TryAlone();
    ::flock(workers_, LOCK_SH);
    if (SaysThisBoot(workers_)) return;
  }
  RefuseOtherMachine();
}

void DataFolder::LetWorkersIn() { HoldTogether(); }

uintmax_t DataFolder::FreeBytes() const {
  std::error_code error;
  const auto space = std::filesystem::space(root_, error);
  return error ? 0 : space.available;
}

}  // namespace kvx
