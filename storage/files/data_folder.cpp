// flock(2): released by the kernel however the process ends. The workers' lock file says on which start of
// which machine it is held, as leases go by that machine's clock and the database needs one machine's memory,
// and by which version, as all who build for a service answer for one; whoever finds it free writes that
// anew, so a restart, a crash or a copy of the folder refuses nobody.
#include "storage/files/data_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>

#include "core/errors.h"
#include "core/version.h"

namespace kvx {

namespace {

constexpr char kNotWritable[] = "the data folder cannot be written; give another with --data";
constexpr char kMayNotWrite[] = "the data folder may not be written; give another with --data";

constexpr char kServiceLock[] = "lock", kWorkersLock[] = "workers.lock";

int OpenLock(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0 && IsDenial(errno)) throw Denied(kMayNotWrite);
  if (file < 0) throw Unavailable(kNotWritable);
  return file;
}

// The same in all containers of a machine until it is started anew. Empty: not to be known here.
std::string ThisBoot() {
  std::string id;
  std::ifstream("/proc/sys/kernel/random/boot_id") >> id;
  return id;
}

// As the lock file says: a line each. Programs of before said the first alone, or nothing.
struct Holder {
  std::string boot, version;
  bool IsHere() const {
    const std::string here = ThisBoot();
    return boot.empty() || here.empty() || boot == here;
  }
  bool IsOurs() const {
    const bool says_nothing = boot.empty() && version.empty();
    return IsHere() && (says_nothing || version == ProgramVersion());
  }
};

// A disk that is full holds nobody up: what says nothing refuses nobody.
void SayWhoHolds(int lock) {
  const std::string text = ThisBoot() + "\n" + ProgramVersion();
  if (::ftruncate(lock, 0) != 0) throw Unavailable(kNotWritable);
  if (::pwrite(lock, text.data(), text.size(), 0) == ssize_t(text.size())) return;
  if (::ftruncate(lock, 0) != 0) throw Unavailable(kNotWritable);
}

Holder HolderOf(int lock) {
  char text[128];
  const ssize_t size = ::pread(lock, text, sizeof text, 0);
  Holder holder;
  std::istringstream lines(std::string(text, size_t(std::max<ssize_t>(size, 0))));
  std::getline(lines, holder.boot);
  std::getline(lines, holder.version);
  return holder;
}

[[noreturn]] void RefuseBeside(const Holder& other) {
  if (!other.IsHere())
    throw Conflict(
        "kinevox uses this data folder on another machine, and a service and its workers run on one; stop "
        "what runs there, or start this there");
  const std::string version = other.version.empty() ? "an older kinevox" : "kinevox " + other.version;
  throw Conflict(version + " uses this data folder, and this is " + ProgramVersion() +
                 "; a service and its workers have one version: stop what runs there first, or start that "
                 "version here");
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
} catch (const std::filesystem::filesystem_error& error) {
  if (IsDenial(error.code())) throw Denied(kMayNotWrite);
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
  // A worker that starts has the lock alone for a moment, and then says who it is.
  for (int tries = 0; !alone_ && !HolderOf(workers_).IsOurs(); ++tries) {
    if (tries == 10) RefuseBeside(HolderOf(workers_));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    alone_ = TryAlone();
  }
}

// False: somebody else holds the workers' lock.
bool DataFolder::TryAlone() {
  if (::flock(workers_, LOCK_EX | LOCK_NB) != 0) return false;
  SayWhoHolds(workers_);
  return true;
}

// Between being alone and sharing another may be alone (flock converts in two steps), so what is said is read
// once the lock is shared: from then on nobody writes it.
void DataFolder::HoldTogether() {
  for (int tries = 0; tries < 3; ++tries) {
    TryAlone();
    ::flock(workers_, LOCK_SH);
    if (HolderOf(workers_).IsOurs()) return;
  }
  RefuseBeside(HolderOf(workers_));
}

void DataFolder::LetWorkersIn() { HoldTogether(); }

uintmax_t DataFolder::FreeBytes() const {
  std::error_code error;
  const auto space = std::filesystem::space(root_, error);
  return error ? 0 : space.available;
}

// A file system may hold only so many (inodes), whatever their size. One that has no such number says 0 of
// all.
bool DataFolder::HasRoomForFiles() const {
  constexpr fsfilcnt_t kOfSomeJobs = 1024;
  struct statvfs disk {};
  return ::statvfs(root_.c_str(), &disk) != 0 || disk.f_files == 0 || disk.f_favail >= kOfSomeJobs;
}

}  // namespace kvx
