// Uploaded bytes, stored once per content:
// blobs/ab/<sha256>, or a folder of that name for an unpacked series.
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <mutex>
#include <set>
#include <shared_mutex>
#include <span>
#include <string>

#include "core/digest.h"
#include "core/errors.h"

namespace kvx {

class QuotaExceeded : public InputError {
  using InputError::InputError;
};  // HTTP 413

class BlobStore;

Digest FileDigest(const std::filesystem::path& file);  // plain SHA-256 of its bytes; throws Unavailable
// Whether all bytes of a blob, a file or the folder of a series, are those that its name says. Not where
// nothing is.
bool IsIntact(const std::filesystem::path& blob);

// Bytes on their way in. What is not kept leaves nothing behind.
class IncomingBlob {
 public:
  ~IncomingBlob();
  IncomingBlob(IncomingBlob&&) noexcept;
  IncomingBlob& operator=(IncomingBlob&&) = delete;

  void Write(std::span<const char> bytes);  // throws QuotaExceeded, or Unavailable for a full disk
  void Close();                             // flushed to disk; no more writes
  const std::filesystem::path& path() const { return path_; }
  const Digest& digest() const { return digest_; }  // after Close
  int64_t bytes() const { return bytes_; }

 private:
  friend class BlobStore;

  IncomingBlob(std::filesystem::path path, int64_t quota_bytes);
  explicit IncomingBlob(std::filesystem::path whole);
  std::filesystem::path path_;
  int file_ = -1;
  int64_t quota_bytes_ = 0, bytes_ = 0;
  std::unique_ptr<Hasher> hasher_;
  Digest digest_;
};

// A folder to unpack into; removed unless kept.
class IncomingFolder {
 public:
  ~IncomingFolder();
  IncomingFolder(IncomingFolder&&) noexcept;
  IncomingFolder& operator=(IncomingFolder&&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  friend class BlobStore;

  explicit IncomingFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

class BlobStore {
 public:
  // `alone`: no other process uses the folder, so what a crash left half-written is removed. Throws
  // Unavailable where blobs could not be moved to their place.
  explicit BlobStore(std::filesystem::path root, bool alone = true);

  // `suffix` lets readers know the format of a file that is not kept yet.
  IncomingBlob Receive(const std::string& suffix, int64_t quota_bytes);
  IncomingFolder ReceiveFolder();
  // A file that is whole, under a second name, or copied where the disk has no such; it is read for its
  // digest. The first name stays until its owner removes it.
  IncomingBlob Adopt(const std::filesystem::path& file, const std::string& suffix);
  // The blob's name; the same bytes are stored once, and replace what was damaged under their name.
  std::string Keep(IncomingBlob blob);
  std::string KeepFolder(IncomingFolder folder);  // digest of file names and bytes in sorted order
  std::filesystem::path PathOf(const std::string& name) const;

  // What uploads that were cut off by a kill left; nothing else removes it while a worker runs.
  void RemoveAbandoned(std::chrono::hours untouched);

  // Removes blobs that `in_use` does not name and nobody has placed for `grace`: an upload places its blob
  // first and is recorded a moment later. Other processes may place blobs meanwhile. Returns how many went.
  int RemoveUnused(const std::function<std::set<std::string>()>& in_use, std::chrono::seconds grace);

  // Held from Keep until the record that names the blob is committed: nobody removes the bytes in between.
  // While a removal waits, nobody else begins; so no thread may ask for it twice.
  std::shared_lock<std::shared_mutex> KeepRemovalOut() {
    const std::lock_guard turn(turn_);
    return std::shared_lock(removal_);
  }
  std::unique_lock<std::shared_mutex> KeepOthersOut() {
    const std::lock_guard turn(turn_);
    return std::unique_lock(removal_);
  }
  void Remove(const std::string& name);  // no record may name it

 private:
  std::mutex turn_;  // of asking for the next one
  std::shared_mutex removal_;
  std::string Place(const std::filesystem::path& from, const Digest& digest, bool folder);
  void PutAside(const std::filesystem::path& damaged);
  std::filesystem::path root_;
};

}  // namespace kvx
