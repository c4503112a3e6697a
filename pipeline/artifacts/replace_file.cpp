// Temporary file in the same folder, fsync, rename.
#include "pipeline/artifacts/replace_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <fstream>

#include "core/errors.h"

namespace kvx {
namespace {

constexpr const char* kCannotWrite =
    "a file cannot be written; is the output folder there, writable and the disk not full?";

// Hidden, unique on this machine, and with the whole name at its end: extensions decide formats.
std::filesystem::path TemporaryFor(const std::filesystem::path& path) {
  static std::atomic<int> serial = 0;
  std::string name = ".kvx-";
  name.append(std::to_string(getpid())).append("-").append(std::to_string(serial++)).append("-");
  return path.parent_path() / name.append(path.filename().string());
}

void Sync(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = file >= 0 && ::fsync(file) == 0;
  if (file >= 0) ::close(file);
  if (!synced) throw Unavailable(kCannotWrite);
}

}  // namespace

void ReplaceFileBy(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write) {
  const std::filesystem::path temporary = TemporaryFor(path);
  std::error_code error;
  try {
    write(temporary);
    Sync(temporary);
    std::filesystem::rename(temporary, path, error);
    if (error) throw Unavailable(kCannotWrite);
  } catch (...) {
    std::filesystem::remove(temporary, error);
    throw;
  }
}

void ReplaceFile(const std::filesystem::path& path, std::string_view bytes) {
  ReplaceFileBy(path, [&](const std::filesystem::path& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    file.write(bytes.data(), std::streamsize(bytes.size()));
    file.close();
    if (!file) throw Unavailable(kCannotWrite);
  });
}

}  // namespace kvx
