// Use is remembered in memory and, for the next start, in the files' modification times.
#include "storage/result_cache.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <future>
#include <map>
#include <mutex>
#include <set>
#include <vector>

#include "core/errors.h"
#include "storage/ids.h"

namespace kvx {

namespace fs = std::filesystem;
using FilePtr = std::shared_ptr<const CachedFile>;

CachedFile::CachedFile(const fs::path& path) : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  struct stat status {};
  if (file_ < 0 || ::fstat(file_, &status) != 0) {
    if (file_ >= 0) ::close(file_);
    throw Unavailable("a computed result cannot be read back; ask again");
  }
  size_ = size_t(status.st_size);
}

CachedFile::~CachedFile() { ::close(file_); }

size_t CachedFile::ReadAt(size_t offset, char* out, size_t count) const {
  const ssize_t got = ::pread(file_, out, count, off_t(offset));
  if (got < 0) throw Unavailable("a computed result cannot be read back; ask again");
  return size_t(got);
}

struct ResultCache::State {
  struct Kept {
    int64_t bytes = 0;
    uint64_t last_use = 0;
  };
  fs::path folder;
  int64_t limit_bytes;
  mutable std::mutex mutex;
  std::map<std::string, Kept> kept;
  std::map<std::string, std::shared_future<FilePtr>> making;
  std::set<std::string> gone;  // starts of names that are no longer kept
  uint64_t uses = 0;
  CacheFigures figures;

  bool Gone(const std::string& name) const {
    return std::ranges::any_of(gone, [&](const std::string& start) { return name.starts_with(start); });
  }

  void TakeOver();
  FilePtr Use(const std::string& name, Kept& kept);  // empty when the file is gone
  void Forget(const std::string& name);
  void Remember(const std::string& name, int64_t bytes);
  void DropBeyondLimit(const std::string& spare);
};

void ResultCache::State::TakeOver() {
  std::vector<fs::directory_entry> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename().string().starts_with("new_")) fs::remove(entry.path());
    else files.push_back(entry);
  }
  std::ranges::sort(files, {}, [](const fs::directory_entry& f) { return f.last_write_time(); });
  for (const auto& file : files) Remember(file.path().filename().string(), int64_t(file.file_size()));
  DropBeyondLimit("");
}

void ResultCache::State::Remember(const std::string& name, int64_t bytes) {
  kept[name] = {bytes, ++uses};
  figures.bytes += bytes;
}

void ResultCache::State::DropBeyondLimit(const std::string& spare) {
  while (figures.bytes > limit_bytes && kept.size() > 1) {
    auto oldest = kept.end();
    for (auto it = kept.begin(); it != kept.end(); ++it) {
      if (it->first != spare && (oldest == kept.end() || it->second.last_use < oldest->second.last_use)) oldest = it;
    }
    std::error_code ignored;
    fs::remove(folder / oldest->first, ignored);
    Forget(oldest->first);
  }
}

void ResultCache::State::Forget(const std::string& name) {
  const auto found = kept.find(name);
  figures.bytes -= found->second.bytes;
  kept.erase(found);
}

FilePtr ResultCache::State::Use(const std::string& name, Kept& entry) {
  std::error_code error;
  fs::last_write_time(folder / name, fs::file_time_type::clock::now(), error);
  if (error) return nullptr;
  entry.last_use = ++uses;
  ++figures.hits;
  return std::make_shared<CachedFile>(folder / name);
}

ResultCache::ResultCache(fs::path folder, int64_t limit_bytes) : state_(std::make_unique<State>()) {
  state_->folder = std::move(folder);
  state_->limit_bytes = limit_bytes;
  std::error_code error;
  fs::create_directories(state_->folder, error);
  if (error) throw Unavailable("the data folder cannot be written; give another with --data");
  state_->TakeOver();
}

ResultCache::~ResultCache() = default;

FilePtr ResultCache::Get(const std::string& name, const Make& make) {
  std::promise<FilePtr> promise;
  {
    std::unique_lock lock(state_->mutex);
    if (const auto found = state_->kept.find(name); found != state_->kept.end()) {
      if (auto file = state_->Use(name, found->second)) return file;
      state_->Forget(name);  // somebody removed the file
    }
    if (const auto found = state_->making.find(name); found != state_->making.end()) {
      const auto waiting = found->second;
      ++state_->figures.hits;
      lock.unlock();
      return waiting.get();
    }
    ++state_->figures.misses;
    state_->making[name] = promise.get_future().share();
  }
  const fs::path temporary = state_->folder / (NewId("new") + "-" + name);
  try {
    make(temporary);
    auto file = std::make_shared<const CachedFile>(temporary);
    const std::lock_guard lock(state_->mutex);
    if (state_->Gone(name)) {
      fs::remove(temporary);
    } else {
      fs::rename(temporary, state_->folder / name);
      state_->Remember(name, int64_t(file->size()));
      state_->DropBeyondLimit(name);
    }
    state_->making.erase(name);
    promise.set_value(file);
    return file;
  } catch (...) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    const std::lock_guard lock(state_->mutex);
    state_->making.erase(name);
    promise.set_exception(std::current_exception());
    throw;
  }
}

void ResultCache::DropOf(const std::string& start) {
  const std::lock_guard lock(state_->mutex);
  state_->gone.insert(start);
  for (auto next = state_->kept.lower_bound(start); next != state_->kept.end() && next->first.starts_with(start);) {
    const std::string name = (next++)->first;
    std::error_code ignored;
    fs::remove(state_->folder / name, ignored);
    state_->Forget(name);
  }
}

CacheFigures ResultCache::Figures() const {
  const std::lock_guard lock(state_->mutex);
  CacheFigures figures = state_->figures;
  figures.files = int64_t(state_->kept.size());
  return figures;
}

}  // namespace kvx
