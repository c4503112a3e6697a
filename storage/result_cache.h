// Computed files kept on disk, bounded in size, the least recently used dropped first. Each is made once, however many ask.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace kvx {

// An open file: it stays readable when the cache drops it meanwhile.
class CachedFile {
 public:
  explicit CachedFile(const std::filesystem::path& path);  // throws Unavailable
  ~CachedFile();
  CachedFile(const CachedFile&) = delete;
  CachedFile& operator=(const CachedFile&) = delete;
  size_t size() const { return size_; }
  size_t ReadAt(size_t offset, char* out, size_t count) const;  // thread-safe; throws Unavailable

 private:
  int file_ = -1;
  size_t size_ = 0;
};

struct CacheFigures {
  int64_t hits = 0, misses = 0, bytes = 0, files = 0;
};

class ResultCache {
 public:
  using Make = std::function<void(const std::filesystem::path&)>;

  ResultCache(std::filesystem::path folder, int64_t limit_bytes);  // takes over what the folder holds
  ~ResultCache();

  // `name` says all that the bytes depend on, and the suffix: "<digest>.nii.gz". `make` writes the file at the path it is
  // given; what it throws reaches all who wait for this name.
  std::shared_ptr<const CachedFile> Get(const std::string& name, const Make& make);
  void DropOf(const std::string& start);  // all whose names start so, those under way too
  CacheFigures Figures() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
