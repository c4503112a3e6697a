// A blob is complete or absent: temporary name, fsync, rename, fsync of the folder.
#include "storage/files/blob_store.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "storage/files/flush_to_disk.h"
#include "storage/ids.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;

constexpr char kNotStored[] = "the upload cannot be stored; is the disk full?";
constexpr char kTwoDisks[] =
    "the parts of the data folder lie on different disks (blobs, incoming); keep all of it on one";

void Flush(const fs::path& path) {
  if (!FlushToDisk(path)) throw Unavailable(kNotStored);
}

[[noreturn]] void ThrowNotRead(const std::error_code& error) {
  if (IsDenial(error))
    throw Denied("an upload may not be read; give the user of this program the right to it");
  throw Unavailable("an upload cannot be read back; is its disk sound?");
}

int64_t AddFile(Hasher& hasher, const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) ThrowNotRead({errno, std::generic_category()});
  std::vector<std::byte> buffer(1 << 16);
  ssize_t count = 0;
  int64_t total = 0;
  while ((count = ::read(file, buffer.data(), buffer.size())) > 0) {
    hasher.Raw({buffer.data(), size_t(count)});
    total += count;
  }
  ::close(file);
  if (count < 0) ThrowNotRead({errno, std::generic_category()});
  return total;
}

// A link, or else a copy: some disks know no second names, and none reach over disks.
void NameAgain(const fs::path& file, const fs::path& name) {
  std::error_code error, ignored;
  fs::create_hard_link(file, name, error);
  if (!error) return;
  error.clear();
  fs::copy_file(file, name, error);
  if (!error && FlushToDisk(name)) return;
  fs::remove(name, ignored);
  throw Unavailable("the upload cannot be stored; is the data folder writable and its disk not full?");
}

bool OnOneDisk(const fs::path& a, const fs::path& b) {
  struct stat of_a {};
  struct stat of_b {};
  return ::stat(a.c_str(), &of_a) != 0 || ::stat(b.c_str(), &of_b) != 0 || of_a.st_dev == of_b.st_dev;
}

bool Touch(const fs::path& path) { return ::utimensat(AT_FDCWD, path.c_str(), nullptr, 0) == 0; }

std::vector<fs::path> FilesOf(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

Digest FolderDigest(const fs::path& folder) try {
  Hasher hasher;
  for (const fs::path& file : FilesOf(folder)) {
    hasher.Add(file.filename().string()).Add(int64_t(fs::file_size(file)));
    AddFile(hasher, file);
  }
  return hasher.Finish();
} catch (const fs::filesystem_error& error) {
  ThrowNotRead(error.code());
}

}  // namespace

bool IsIntact(const fs::path& blob) {
  std::error_code error;
  const fs::file_status status = fs::status(blob, error);
  if (IsDenial(error)) ThrowNotRead(error);
  if (!fs::exists(status)) return false;
  const Digest digest = fs::is_directory(status) ? FolderDigest(blob) : FileDigest(blob);
  return digest.Hex() == blob.filename();
}

Digest FileDigest(const fs::path& file) {
  Hasher hasher;
  AddFile(hasher, file);
  return hasher.Finish();
}

IncomingBlob::IncomingBlob(fs::path path, int64_t quota_bytes)
    : path_(std::move(path)), quota_bytes_(quota_bytes), hasher_(std::make_unique<Hasher>()) {
  file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (file_ < 0) throw Unavailable("the upload cannot be stored; is the data folder writable?");
}

IncomingBlob::IncomingBlob(fs::path whole) : path_(std::move(whole)) {
  Hasher hasher;
  bytes_ = quota_bytes_ = AddFile(hasher, path_);
  digest_ = hasher.Finish();
}

IncomingBlob::IncomingBlob(IncomingBlob&& other) noexcept
    : path_(std::exchange(other.path_, {})),
      file_(std::exchange(other.file_, -1)),
      quota_bytes_(other.quota_bytes_),
      bytes_(other.bytes_),
      hasher_(std::move(other.hasher_)),
      digest_(other.digest_) {}

IncomingBlob::~IncomingBlob() {
  if (file_ >= 0) ::close(file_);
  if (!path_.empty()) ::unlink(path_.c_str());
}

void IncomingBlob::Write(std::span<const char> bytes) {
  bytes_ += int64_t(bytes.size());
  if (bytes_ > quota_bytes_) throw QuotaExceeded("the upload is larger than the service accepts");
  hasher_->Raw(std::as_bytes(bytes));
  while (!bytes.empty()) {
    const ssize_t written = ::write(file_, bytes.data(), bytes.size());
    if (written <= 0) throw Unavailable(kNotStored);
    bytes = bytes.subspan(size_t(written));
  }
}

void IncomingBlob::Close() {
  if (file_ < 0) return;
  const bool synced = ::fsync(file_) == 0;
  ::close(std::exchange(file_, -1));
  if (!synced) throw Unavailable(kNotStored);
  digest_ = hasher_->Finish();
}

IncomingFolder::IncomingFolder(IncomingFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}

IncomingFolder::~IncomingFolder() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove_all(path_, ignored);
}

BlobStore::BlobStore(fs::path root, bool alone) : root_(std::move(root)) {
  std::error_code error;
  if (alone) fs::remove_all(root_ / "incoming", error);
  if (fs::create_directories(root_ / "incoming", error))
    fs::permissions(root_ / "incoming", fs::perms::owner_all, error);
  fs::create_directories(root_ / "blobs", error);
  if (error) throw Unavailable("the data folder cannot be written; give another with --data");
  if (!OnOneDisk(root_ / "incoming", root_ / "blobs")) throw Unavailable(kTwoDisks);
}

IncomingBlob BlobStore::Receive(const std::string& suffix, int64_t quota_bytes) {
  return IncomingBlob(root_ / "incoming" / (NewId("in") + suffix), quota_bytes);
}

IncomingFolder BlobStore::ReceiveFolder() {
  IncomingFolder folder(root_ / "incoming" / NewId("in"));
  fs::create_directory(folder.path());
  return folder;
}

IncomingBlob BlobStore::Adopt(const fs::path& file, const std::string& suffix) {
  const fs::path name = root_ / "incoming" / (NewId("in") + suffix);
  Flush(file);
  NameAgain(file, name);
  return IncomingBlob(name);
}

std::string BlobStore::Keep(IncomingBlob blob) {
  blob.Close();
  return Place(blob.path(), blob.digest(), false);
}

std::string BlobStore::KeepFolder(IncomingFolder folder) {
  for (const fs::path& file : FilesOf(folder.path())) Flush(file);
  return Place(folder.path(), FolderDigest(folder.path()), true);
}

std::string BlobStore::Place(const fs::path& from, const Digest& digest, bool folder) {
  const std::string name = digest.Hex();
  const fs::path target = PathOf(name);
  // The touch says that somebody is about to record what is there.
  const bool there = Touch(target);
  if (there && IsIntact(target)) return name;
  if (there) PutAside(target);
  fs::create_directories(target.parent_path());
  if (folder) Flush(from);
  Touch(from);  // its bytes may have come long ago
  std::error_code error;
  fs::rename(from, target, error);  // a folder that another upload has just placed stays
  if (error && !Touch(target))
    throw Unavailable(error == std::errc::cross_device_link ? kTwoDisks : kNotStored);
  Flush(target.parent_path());
  return name;
}

void BlobStore::PutAside(const fs::path& damaged) {
  const fs::path aside = root_ / "incoming" / NewId("old");
  std::error_code error;
  fs::rename(damaged, aside, error);
  if (!error) fs::remove_all(aside, error);
}

void BlobStore::RemoveAbandoned(std::chrono::hours untouched) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(root_ / "incoming", error)) {
    const auto touched = fs::last_write_time(entry.path(), error);
    if (!error && fs::file_time_type::clock::now() - touched > untouched) fs::remove_all(entry.path(), error);
  }
}

int BlobStore::RemoveUnused(const std::function<std::set<std::string>()>& in_use,
                            std::chrono::seconds grace) {
  const auto fresh = [&](const fs::path& path) {
    std::error_code error;
    const auto placed = fs::last_write_time(path, error);
    return error || fs::file_time_type::clock::now() - placed < grace;
  };
  std::vector<fs::path> old;
  std::error_code error;
  for (const auto& shelf : fs::directory_iterator(root_ / "blobs")) {
    for (const auto& blob : fs::directory_iterator(shelf.path(), error)) {
      if (!fresh(blob.path())) old.push_back(blob.path());
    }
  }
  if (old.empty()) return 0;
  const std::set<std::string> used = in_use();
  int removed = 0;
  for (const fs::path& blob : old) {
    if (used.contains(blob.filename().string())) continue;
    // Out of the way first: whoever places these bytes from now on makes a new blob.
    // Whoever touched it before is seen.
    const fs::path aside = root_ / "incoming" / NewId("old");
    fs::rename(blob, aside, error);
    if (error) continue;
    if (fresh(aside)) {
      fs::rename(aside, blob, error);
      continue;
    }
    fs::remove_all(aside, error);
    ++removed;
  }
  return removed;
}

void BlobStore::Remove(const std::string& name) {
  std::error_code error;
  fs::remove_all(PathOf(name), error);
  if (error)
    throw Unavailable(
        "bytes of a removed subject cannot be removed now; it is tried again within the hour");
}

fs::path BlobStore::PathOf(const std::string& name) const {
  return root_ / "blobs" / name.substr(0, 2) / name;
}

}  // namespace kvx
