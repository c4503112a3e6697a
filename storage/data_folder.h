// The service's data folder: what lies where, and the lock that lets one process use it.
#pragma once
#include <filesystem>

namespace kvx {

class DataFolder {
 public:
  // Made when missing. Throws Conflict when another process holds it, Unavailable when it cannot be written.
  explicit DataFolder(const std::filesystem::path& root);
  ~DataFolder();
  DataFolder(const DataFolder&) = delete;
  DataFolder& operator=(const DataFolder&) = delete;

  const std::filesystem::path& root() const { return root_; }
  std::filesystem::path database() const { return root_ / "kinevox.db"; }
  std::filesystem::path artifacts() const { return root_ / "artifacts"; }
  std::filesystem::path results() const { return root_ / "results"; }
  std::filesystem::path work() const { return root_ / "work"; }  // emptied at start
  std::filesystem::path Model(const std::string& id) const { return root_ / "models" / id; }
  uintmax_t FreeBytes() const;

 private:
  std::filesystem::path root_;
  int lock_ = -1;
};

}  // namespace kvx
