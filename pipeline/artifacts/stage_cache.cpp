// Artefact files: "KVA1", SHA-256 of the payload, zstd frames.
#include "pipeline/artifacts/stage_cache.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <new>
#include <random>
#include <vector>

#include "core/errors.h"
#include "core/host/parallel.h"

namespace kvx {
namespace {

constexpr std::string_view kMagic = "KVA1";
constexpr size_t kHeader = 4 + 32;
constexpr size_t kFrameBytes = 1 << 22;    // packed and unpacked side by side
constexpr size_t kWorthAThread = 1 << 20;  // bytes to hash and write
constexpr int kCompressionLevel = 1;       // fields are mostly air: level 1 already removes it

std::vector<RawBytes> Compress(std::string_view bytes) {
  std::vector<RawBytes> frames;
  for (size_t at = 0; at == 0 || at < bytes.size(); at += kFrameBytes)
    frames.emplace_back(ZSTD_compressBound(std::min(kFrameBytes, bytes.size() - at)));
  ParallelFor(frames.size(), [&](size_t n) {
    const std::string_view part = bytes.substr(n * kFrameBytes, kFrameBytes);
    RawBytes& out = frames[n];
    out.size = ZSTD_compress(out.data.get(), out.size, part.data(), part.size(), kCompressionLevel);
    if (ZSTD_isError(out.size)) throw std::bad_alloc();  // it lacks nothing else
  });
  return frames;
}

struct Frame {
  std::string_view packed;
  size_t at, size;  // unpacked
};

// Nothing when they are damaged, or say that they hold more than zstd can pack in so few bytes.
std::optional<std::vector<Frame>> FramesOf(std::string_view packed) {
  constexpr size_t kMostPerByte = 1 << 16;  // a block of 128 KiB takes four bytes at least
  const size_t most = kMostPerByte * packed.size();
  std::vector<Frame> frames;
  size_t at = 0;
  while (!packed.empty()) {
    const size_t length = ZSTD_findFrameCompressedSize(packed.data(), packed.size());
    if (ZSTD_isError(length)) return std::nullopt;
    const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
    if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN) return std::nullopt;
    if (size > most - at) return std::nullopt;
    frames.push_back({packed.substr(0, length), at, size_t(size)});
    at += size_t(size);
    packed.remove_prefix(length);
  }
  return frames;
}

std::optional<RawBytes> Decompress(std::string_view packed) {
  const std::optional<std::vector<Frame>> frames = FramesOf(packed);
  if (!frames || frames->empty()) return std::nullopt;
  RawBytes out(frames->back().at + frames->back().size);
  std::atomic<bool> whole = true;
  ParallelFor(frames->size(), [&](size_t n) {
    const Frame& f = (*frames)[n];
    if (ZSTD_decompress(out.data.get() + f.at, f.size, f.packed.data(), f.packed.size()) != f.size)
      whole = false;
  });
  if (!whole) return std::nullopt;
  return out;
}

void WriteAll(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written <= 0) throw Unavailable("a result cannot be stored; is the disk full?");
    bytes.remove_prefix(size_t(written));
  }
}

void Seek(int file, size_t at) {
  if (::lseek(file, off_t(at), SEEK_SET) < 0)
    throw Unavailable("a result cannot be stored; is the disk full?");
}

// Nothing waits for it, and nothing relies on it: what has to be on the disk in the end is on its way.
void BeginToSync([[maybe_unused]] int file, [[maybe_unused]] size_t at, [[maybe_unused]] size_t bytes) {
#ifdef SYNC_FILE_RANGE_WRITE
  ::sync_file_range(file, off_t(at), off_t(bytes), SYNC_FILE_RANGE_WRITE);
#endif
}

Digest DigestOf(const std::vector<RawBytes>& frames) {
  Hasher hasher;
  for (const RawBytes& frame : frames) hasher.Raw(std::as_bytes(std::span(frame.view())));
  return hasher.Finish();
}

// The header, which holds the digest, comes last: the frames are hashed while they are written.
void WritePacked(const std::vector<RawBytes>& frames, int file) {
  Digest digest;
  const auto hash = [&] { digest = DigestOf(frames); };
  const auto write = [&] {
    Seek(file, kHeader);
    size_t at = kHeader;
    for (const RawBytes& frame : frames) {
      WriteAll(file, frame.view());
      if (frame.size > kWorthAThread) BeginToSync(file, at, frame.size);
      at += frame.size;
    }
  };
  size_t packed = 0;
  for (const RawBytes& frame : frames) packed += frame.size;
  if (packed > kWorthAThread)
    SideBySide(hash, write);
  else
    hash(), write();
  Seek(file, 0);
  WriteAll(file, kMagic);
  WriteAll(file, {reinterpret_cast<const char*>(digest.bytes.data()), digest.bytes.size()});
}

// Failed where there is no such file. Throws Unavailable where the process may open no more: what is there
// would count as missing.
std::ifstream Opened(const std::filesystem::path& path, std::ios::openmode mode = {}) {
  std::ifstream file(path, std::ios::binary | mode);
  if (!file && (errno == EMFILE || errno == ENFILE || errno == ENOMEM))
    throw Unavailable("too many files are open; try again later");
  return file;
}

}  // namespace

StageCache::StageCache(std::filesystem::path folder) : folder_(std::move(folder)) {}

std::filesystem::path StageCache::PathOf(const Digest& key) const {
  const std::string hex = key.Hex();
  return folder_ / hex.substr(0, 2) / (hex + ".kva");
}

bool StageCache::Has(const Digest& key) const { return std::filesystem::exists(PathOf(key)); }

// The whole file, checked; nothing when absent or damaged.
std::optional<RawBytes> StageCache::ReadChecked(const Digest& key) const {
  std::ifstream file = Opened(PathOf(key), std::ios::ate);
  if (!file) return std::nullopt;
  RawBytes all(size_t(std::max<std::streamoff>(0, file.tellg())));
  file.seekg(0);
  if (!file.read(all.data.get(), std::streamsize(all.size))) return std::nullopt;
  if (all.size < kHeader || !all.view().starts_with(kMagic)) return std::nullopt;
  const Digest checked = Sha256(all.view().substr(kHeader));
  if (std::memcmp(checked.bytes.data(), all.data.get() + kMagic.size(), 32) != 0) return std::nullopt;
  return all;
}

bool StageCache::Intact(const Digest& key) const { return ReadChecked(key).has_value(); }

std::optional<RawBytes> StageCache::Read(const Digest& key) const {
  const auto all = ReadChecked(key);
  if (!all) return std::nullopt;
  return Decompress(all->view().substr(kHeader));
}

std::optional<Digest> StageCache::BytesDigest(const Digest& key) const {
  std::ifstream file = Opened(PathOf(key));
  std::array<char, kHeader> header;
  if (!file.read(header.data(), header.size())) return std::nullopt;
  if (!std::string_view(header.data(), header.size()).starts_with(kMagic)) return std::nullopt;
  Digest digest;
  std::memcpy(digest.bytes.data(), header.data() + kMagic.size(), digest.bytes.size());
  return digest;
}

void StageCache::Write(const Digest& key, std::string_view bytes) const { Write(key, bytes, Synced::kYes); }

void StageCache::WriteUnsynced(const Digest& key, std::string_view bytes) const {
  Write(key, bytes, Synced::kNo);
}

void StageCache::Write(const Digest& key, std::string_view bytes, Synced synced) const {
  const std::filesystem::path path = PathOf(key);
  std::error_code error;
  std::filesystem::create_directories(path.parent_path(), error);
  const std::string temporary =
      path.string() + "." + std::to_string(getpid()) + "." + std::to_string(std::random_device()());
  const std::vector<RawBytes> frames = Compress(bytes);
  const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644);
  if (file < 0) throw Unavailable("a result cannot be stored; is the data folder writable?");
  ::flock(file, LOCK_SH);  // for RemoveLeftovers
  try {
    WritePacked(frames, file);
    if (synced == Synced::kYes && ::fsync(file) != 0)
      throw Unavailable("a result cannot be stored; is the disk full?");
  } catch (...) {
    ::close(file);
    ::unlink(temporary.c_str());
    throw;
  }
  std::filesystem::rename(temporary, path, error);
  ::close(file);
  if (!error) return;
  ::unlink(temporary.c_str());
  throw Unavailable("a result cannot be stored; is the data folder writable?");
}

}  // namespace kvx
