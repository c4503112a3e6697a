// Files that appear whole or not at all: written under a temporary name, synced, renamed.
#pragma once
#include <filesystem>
#include <string_view>

namespace kvx {

// What a link names, there or not, which is written instead of the link; any other path as it is. A link in
// /proc is an open file, and is returned itself.
std::filesystem::path BehindLinks(const std::filesystem::path& path);

// An empty file beside `path`, with the same extension in lower case (ITK knows no other), to be written
// over; it is removed unless Commit was called.
class AtomicFile {
 public:
  // Throws InputError where `path` is a folder, a device, a pipe, an open file (/dev/stdout) or means one
  // ("-"), lies in no folder or has too long a name; Unavailable where no file can be made. What a link names
  // is written, and stays behind it.
  explicit AtomicFile(const std::filesystem::path& path);
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
