// POSIX rename is atomic within one folder; the folder is synced too, so that the name survives a crash.
#include "pipeline/io/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <fstream>
#include <random>

#include "core/errors.h"
#include "core/text/lower_case.h"

namespace kvx {
namespace {

const char kCannotWrite[] = "a file cannot be written; is the output folder writable and the disk not full?";

const char kMayNotWrite[] = "a file may not be written; choose a folder where you may write";

bool Sync(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool synced = ::fsync(file) == 0;
  ::close(file);
  return synced;
}

std::filesystem::path FolderOf(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : ".";
}

// As /dev/stdout leads to: a file under that name has a reader or a writer already, and an end of its own.
bool IsOpenFile(const std::filesystem::path& link) {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::canonical(FolderOf(link), error);
  return !error && folder.string().starts_with("/proc/");
}

// A name that nobody can guess: others may write into the folder, and lay links there. It ends as that of
// `path` does, which may be as long as a name can be.
std::filesystem::path TemporaryBeside(const std::filesystem::path& path) {
  const std::string prefix = ".part-" + std::to_string(std::random_device()()) + "-";
  std::string name = LowerCase(path.filename().string());
  if (name.size() > NAME_MAX)
    throw InputError("the output's name is longer than 255 bytes; give a shorter one");
  if (prefix.size() + name.size() > NAME_MAX) name.erase(0, prefix.size());
  return path.parent_path() / (prefix + name);
}

}  // namespace

std::filesystem::path BehindLinks(const std::filesystem::path& path) {
  constexpr int kMostLinks = 40;  // as the kernel follows
  std::filesystem::path behind = path;
  std::error_code error;
  for (int links = 0; std::filesystem::is_symlink(behind, error) && !IsOpenFile(behind); ++links) {
    if (links == kMostLinks) return path;
    const std::filesystem::path next = std::filesystem::read_symlink(behind, error);
    if (error) return path;
    behind = FolderOf(behind) / next;
  }
  return behind;
}

AtomicFile::AtomicFile(const std::filesystem::path& path)
    : path_(BehindLinks(path)), temporary_(TemporaryBeside(path_)) {
  if (path == "-") throw InputError("the output goes to a file, not to stdout; give the name of a file");
  std::error_code ignored;
  if (std::filesystem::is_directory(path_, ignored))
    throw InputError("the output is a folder already; give the name of a file");
  const bool device =
      std::filesystem::exists(path_, ignored) && !std::filesystem::is_regular_file(path_, ignored);
  if (device || std::filesystem::is_symlink(path_, ignored))
    throw InputError(
        "the output is a device, a pipe or a file that is open already; give the name of a file");
  if (!std::filesystem::is_directory(FolderOf(path_), ignored))
    throw InputError("the folder that the output is to lie in does not exist; make it first");
  const int file = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (file < 0 && IsDenial(errno)) throw Denied(kMayNotWrite);
  if (file < 0) throw Unavailable(kCannotWrite);
  ::close(file);
}

AtomicFile::~AtomicFile() {
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void AtomicFile::Commit() {
  if (!Sync(temporary_)) throw Unavailable(kCannotWrite);
  std::error_code failed;
  std::filesystem::rename(temporary_, path_, failed);
  if (IsDenial(failed)) throw Denied(kMayNotWrite);
  if (failed) throw Unavailable(kCannotWrite);
  Sync(FolderOf(path_));
}

void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes) {
  AtomicFile file(path);
  std::ofstream out(file.temporary(), std::ios::binary);
  out.write(bytes.data(), std::streamsize(bytes.size()));
  out.close();
  if (!out) throw Unavailable(kCannotWrite);
  file.Commit();
}

}  // namespace kvx
