// A computed file as it is sent.
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>

namespace kvx {

// An open file, or its bytes in memory: it stays readable when the cache drops it meanwhile.
class CachedFile {
 public:
  explicit CachedFile(const std::filesystem::path& path);  // throws Unavailable
  explicit CachedFile(std::string bytes) : bytes_(std::move(bytes)), size_(bytes_.size()) {}
  ~CachedFile();
  CachedFile(const CachedFile&) = delete;
  CachedFile& operator=(const CachedFile&) = delete;
  size_t size() const { return size_; }
  size_t ReadAt(size_t offset, char* out, size_t count) const;  // thread-safe; throws Unavailable

 private:
  int file_ = -1;
  std::string bytes_;  // when there is no file
  size_t size_ = 0;
};

}  // namespace kvx
