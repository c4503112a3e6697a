// The service's data folder: what lies where, and the locks: one service at a time, workers beside it.
#pragma once
#include <filesystem>

namespace kvx {

constexpr char kDatabaseFile[] = "kinevox.db";  // of a data folder, and of a backup

bool IsDataFolder(const std::filesystem::path& root);
// Whether a service or a worker has ever run on it, or a backup was restored to it.
bool IsLocked(const std::filesystem::path& root);
// Makes the lock file that tells a data folder from a backup. Throws filesystem_error.
void MakeLocked(const std::filesystem::path& root);
// Missing, empty, or nothing but what a file system itself puts there.
bool HoldsNothing(const std::filesystem::path& folder);
// Makes what is missing of the folder and its database file, for this user alone: they are people's scans.
// What is there keeps its permissions. Throws Unavailable when it cannot be written.
void MakePrivate(const std::filesystem::path& root);

// Missing folders, the last for this user alone; what is there keeps its permissions. Throws
// filesystem_error.
void MakePrivateFolder(const std::filesystem::path& folder);
// An empty file for this user alone, unless it is there. Throws filesystem_error.
void MakePrivateFile(const std::filesystem::path& file);

class DataFolder {
 public:
  enum class Use { kService, kWorker };
  // Made when missing. Throws Conflict when another service holds it, or anything on another machine or of
  // another version does; Unavailable when it cannot be written.
  explicit DataFolder(const std::filesystem::path& root, Use use = Use::kService);
  ~DataFolder();
  DataFolder(const DataFolder&) = delete;
  DataFolder& operator=(const DataFolder&) = delete;

  const std::filesystem::path& root() const { return root_; }
  std::filesystem::path database() const { return root_ / kDatabaseFile; }
  std::filesystem::path artifacts() const { return root_ / "artifacts"; }
  std::filesystem::path results() const { return root_ / "results"; }
  std::filesystem::path uploads() const { return root_ / "uploads"; }  // resumable ones
  std::filesystem::path work() const { return root_ / "work"; }  // emptied by a service that starts alone
  std::filesystem::path Model(const std::string& id) const { return root_ / "models" / id; }
  uintmax_t FreeBytes() const;
  // For so many bytes beyond the reserve, and for files.
  bool HasRoom(uintmax_t reserve_bytes, int64_t more_bytes) const {
    return HasRoomForFiles() && int64_t(FreeBytes()) - int64_t(reserve_bytes) >= more_bytes;
  }
  // No worker of another process was there when this service started:
  // whatever looks like their work is a dead one's.
  bool alone() const { return alone_; }
  void LetWorkersIn();  // once the service has dealt with what dead ones left

 private:
  bool HasRoomForFiles() const;
  void LockForService();
  bool TryAlone();
  void HoldTogether();
  void Unlock();

  std::filesystem::path root_;
  int lock_ = -1;     // of the service
  int workers_ = -1;  // shared by all that run jobs
  bool alone_ = false;
};

}  // namespace kvx
