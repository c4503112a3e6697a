// Files that appear whole or not at all: written under a temporary name, synced, renamed.
#pragma once
#include <filesystem>
#include <string_view>

namespace kvx {

// A name beside `path`, with the same extension in lower case (ITK knows no other);
// the file is removed unless Commit was called.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  const std::filesystem::path& temporary() const { return temporary_; }
  void Commit();  // throws Unavailable when the bytes cannot be brought to the disk

 private:
  std::filesystem::path path_, temporary_;
};

void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace kvx
