// Use is remembered in memory and, for the next start, in the files' modification times. A file has its name
// once its bytes are on the disk: a name is believed after a loss of power, too.
#include "storage/files/result_cache.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <fstream>
#include <future>
#include <map>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "core/errors.h"
#include "storage/files/flush_to_disk.h"
#include "storage/ids.h"
#include "storage/project_shares.h"

namespace kvx {

namespace fs = std::filesystem;
using FilePtr = std::shared_ptr<const CachedFile>;

namespace {
constexpr char kNotStored[] = "a result cannot be stored; is the disk full?";
constexpr int64_t kMostWaitingBytes = int64_t(128) << 20;  // made, and not yet on disk
constexpr auto kLookEvery = std::chrono::milliseconds(50);
constexpr int kPlacesToWait = 128;  // each holds a thread of the service
}  // namespace

struct ResultCache::State {
  struct Kept {
    int64_t bytes = 0;
    uint64_t last_use = 0;
  };
  struct InMemory {
    FilePtr file;
    uint64_t last_use = 0;
  };
  using Waiting = std::shared_future<FilePtr>;
  using ByUse = std::map<uint64_t, std::string>;  // names by their last use, the oldest first
  fs::path folder;
  int64_t limit_bytes, memory_limit_bytes;
  HasRoom has_room;
  mutable std::mutex mutex;
  std::map<std::string, Kept> kept;
  std::map<std::string, InMemory> memory;
  ByUse kept_by_use, memory_by_use;
  std::map<std::string, Waiting> making;
  std::set<std::string> gone;  // starts of names that are no longer kept
  ProjectShares waits{kPlacesToWait, true};
  uint64_t uses = 0;
  CacheFigures figures;

  std::deque<std::pair<std::string, FilePtr>> to_store;
  int64_t to_store_bytes = 0;
  bool stopping = false;
  std::condition_variable arrived;
  std::thread storer;
  bool Gone(const std::string& name) const {
    return std::ranges::any_of(gone, [&](const std::string& start) { return name.starts_with(start); });
  }

  void TakeOver();
  void NoteUse(ByUse& order, const std::string& name, uint64_t& last_use);
  FilePtr Use(const std::string& name, Kept& kept);  // empty when the file is gone
  FilePtr Look(const std::string& name);             // empty when it is neither in memory nor on disk
  void Forget(const std::string& name);
  void Remember(const std::string& name, int64_t bytes);
  void RememberInMemory(const std::string& name, const FilePtr& file);
  void ForgetInMemory(const std::string& name);
  void DropBeyondLimit(const std::string& spare);
  void Drop(std::string name);
  static FilePtr Await(const Waiting& waiting, const Asker& asker);  // empty when its maker gave up
  FilePtr Once(const std::string& name, const std::function<FilePtr()>& make, const Asker& asker);
  void Store(const std::string& name, const CachedFile& file);  // on disk; failing is no loss
  void StoreLoop();
};

// Other processes may remove files meanwhile, and thousands are not asked for their times twice.
void ResultCache::State::TakeOver() {
  struct Found {
    fs::file_time_type last_use;
    std::string name;
    int64_t bytes;
  };
  std::vector<Found> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::error_code gone, ignored;
    const std::string name = entry.path().filename().string();
    const auto bytes = entry.file_size(gone);
    const bool emptied = !gone && bytes == 0;  // by a loss of power: no result is empty
    if (name.starts_with("new_") || emptied) {
      fs::remove(entry.path(), ignored);
      continue;
    }
    const auto last_use = gone ? fs::file_time_type() : entry.last_write_time(gone);
    if (!gone) files.push_back({last_use, name, int64_t(bytes)});
  }
  std::ranges::sort(files, {}, &Found::last_use);
  for (const Found& file : files) Remember(file.name, file.bytes);
  DropBeyondLimit("");
}

void ResultCache::State::NoteUse(ByUse& order, const std::string& name, uint64_t& last_use) {
  order.erase(last_use);
  last_use = ++uses;
  order.emplace(last_use, name);
}

void ResultCache::State::Remember(const std::string& name, int64_t bytes) {
  Kept& entry = kept[name];
  figures.bytes += bytes - entry.bytes;
  entry.bytes = bytes;
  NoteUse(kept_by_use, name, entry.last_use);
}

void ResultCache::State::DropBeyondLimit(const std::string& spare) {
  while (kept.size() > 1 && (figures.bytes > limit_bytes || !has_room(0))) {
    const auto oldest = kept_by_use.begin();
    Drop(oldest->second == spare ? std::next(oldest)->second : oldest->second);
  }
}

void ResultCache::State::Drop(std::string name) {
  std::error_code ignored;
  fs::remove(folder / name, ignored);
  Forget(name);
}

void ResultCache::State::Forget(const std::string& name) {
  const auto found = kept.find(name);
  figures.bytes -= found->second.bytes;
  kept_by_use.erase(found->second.last_use);
  kept.erase(found);
}

FilePtr ResultCache::State::Use(const std::string& name, Kept& entry) {
  std::error_code error;
  fs::last_write_time(folder / name, fs::file_time_type::clock::now(), error);
  if (error) return nullptr;
  NoteUse(kept_by_use, name, entry.last_use);
  ++figures.hits;
  return std::make_shared<CachedFile>(folder / name);
}

FilePtr ResultCache::State::Look(const std::string& name) {
  if (const auto found = memory.find(name); found != memory.end()) {
    NoteUse(memory_by_use, name, found->second.last_use);
    ++figures.hits;
    return found->second.file;
  }
  const auto found = kept.find(name);
  if (found == kept.end()) return nullptr;
  if (auto file = Use(name, found->second)) return file;
  Forget(name);  // somebody removed the file
  return nullptr;
}

void ResultCache::State::RememberInMemory(const std::string& name, const FilePtr& file) {
  if (int64_t(file->size()) > memory_limit_bytes / 2) return;
  if (memory.contains(name)) ForgetInMemory(name);
  InMemory& entry = memory[name];
  entry.file = file;
  NoteUse(memory_by_use, name, entry.last_use);
  figures.memory_bytes += int64_t(file->size());
  while (figures.memory_bytes > memory_limit_bytes)
    ForgetInMemory(std::string(memory_by_use.begin()->second));
}

void ResultCache::State::ForgetInMemory(const std::string& name) {
  const auto found = memory.find(name);
  figures.memory_bytes -= int64_t(found->second.file->size());
  memory_by_use.erase(found->second.last_use);
  memory.erase(found);
}

FilePtr ResultCache::State::Await(const Waiting& waiting, const Asker& asker) {
  while (waiting.wait_for(kLookEvery) != std::future_status::ready) {
    if (asker.HasGone()) throw Cancelled();
  }
  try {
    return waiting.get();
  } catch (const Cancelled&) {
    return nullptr;
  }
}

// Somebody who waits for a maker that gave up because nobody listened to it any more takes its place.
FilePtr ResultCache::State::Once(const std::string& name, const std::function<FilePtr()>& make,
                                 const Asker& asker) {
  std::promise<FilePtr> promise;
  while (true) {
    std::unique_lock lock(mutex);
    if (auto file = Look(name)) return file;
    const auto found = making.find(name);
    if (found == making.end()) {
      ++figures.misses;
      making[name] = promise.get_future().share();
      break;
    }
    const auto waiting = found->second;
    const ProjectShares::Place place = waits.TryTake(asker.project);
    if (!place) throw Unavailable("too many wait for results that are being made; ask again in a moment");
    ++figures.hits;
    lock.unlock();
    if (auto file = Await(waiting, asker)) return file;
  }
  try {
    FilePtr file = make();
    const std::lock_guard lock(mutex);
    making.erase(name);
    promise.set_value(file);
    return file;
  } catch (...) {
    const std::lock_guard lock(mutex);
    making.erase(name);
    promise.set_exception(std::current_exception());
    throw;
  }
}

void ResultCache::State::Store(const std::string& name, const CachedFile& file) {
  fs::path temporary;
  try {
    temporary = folder / (NewId("new") + "-" + name);
    std::ofstream out(temporary, std::ios::binary);
    std::string chunk(std::min<size_t>(file.size(), size_t(1) << 20), '\0');
    for (size_t at = 0; at < file.size();) {
      const size_t count = file.ReadAt(at, chunk.data(), chunk.size());
      out.write(chunk.data(), std::streamsize(count));
      at += count;
    }
    out.close();
    if (!out || !FlushToDisk(temporary)) throw Unavailable(kNotStored);
    const std::lock_guard lock(mutex);
    if (Gone(name)) {
      fs::remove(temporary);
      return;
    }
    fs::rename(temporary, folder / name);
    if (!kept.contains(name)) Remember(name, int64_t(file.size()));
    DropBeyondLimit(name);
  } catch (const std::exception&) {  // it will be made again
    std::error_code ignored;
    fs::remove(temporary, ignored);
  }
}

void ResultCache::State::StoreLoop() {
  std::unique_lock lock(mutex);
  while (true) {
    arrived.wait(lock, [&] { return stopping || !to_store.empty(); });
    if (to_store.empty()) return;
    const auto [name, file] = std::move(to_store.front());
    to_store.pop_front();
    lock.unlock();
    Store(name, *file);
    lock.lock();
    to_store_bytes -= int64_t(file->size());
  }
}

ResultCache::ResultCache(fs::path folder, int64_t limit_bytes, int64_t memory_limit_bytes, HasRoom has_room)
    : state_(std::make_unique<State>()) {
  state_->folder = std::move(folder);
  state_->limit_bytes = limit_bytes;
  state_->memory_limit_bytes = memory_limit_bytes;
  state_->has_room = std::move(has_room);
  std::error_code error;
  fs::create_directories(state_->folder, error);
  if (error) throw Unavailable("the data folder cannot be written; give another with --data");
  state_->TakeOver();
  state_->storer = std::thread([state = state_.get()] { state->StoreLoop(); });
}

ResultCache::~ResultCache() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->stopping = true;
  }
  state_->arrived.notify_all();
  state_->storer.join();
}

FilePtr ResultCache::Get(const std::string& name, const Make& make, const Asker& asker) {
  const auto make_file = [&]() -> FilePtr {
    const fs::path temporary = state_->folder / (NewId("new") + "-" + name);
    try {
      make(temporary);
      if (!FlushToDisk(temporary)) throw Unavailable(kNotStored);
      auto file = std::make_shared<const CachedFile>(temporary);
      const std::lock_guard lock(state_->mutex);
      if (state_->Gone(name)) {
        fs::remove(temporary);
        return file;
      }
      fs::rename(temporary, state_->folder / name);
      state_->Remember(name, int64_t(file->size()));
      state_->DropBeyondLimit(name);
      return file;
    } catch (...) {
      std::error_code ignored;
      fs::remove(temporary, ignored);
      throw;
    }
  };
  return state_->Once(name, make_file, asker);
}

FilePtr ResultCache::GetBytes(const std::string& name, const std::function<std::string()>& make,
                              const Asker& asker) {
  const auto make_file = [&]() -> FilePtr {
    const auto file = std::make_shared<const CachedFile>(make());
    const std::lock_guard lock(state_->mutex);
    if (state_->Gone(name)) return file;
    state_->RememberInMemory(name, file);
    if (state_->to_store_bytes < kMostWaitingBytes) {  // beyond: the disk is too slow, memory has to do
      state_->to_store.emplace_back(name, file);
      state_->to_store_bytes += int64_t(file->size());
      state_->arrived.notify_one();
    }
    return file;
  };
  return state_->Once(name, make_file, asker);
}

FilePtr ResultCache::Find(const std::string& name) {
  const std::lock_guard lock(state_->mutex);
  std::error_code none;
  const auto bytes = fs::file_size(state_->folder / name, none);
  if (!none && !state_->kept.contains(name)) {
    state_->Remember(name, int64_t(bytes));
    state_->DropBeyondLimit(name);
  }
  return state_->Look(name);
}

void ResultCache::MakeRoom(int64_t more_bytes) {
  const std::lock_guard lock(state_->mutex);
  if (!state_->has_room(more_bytes - state_->figures.bytes)) return;
  while (!state_->kept.empty() && !state_->has_room(more_bytes))
    state_->Drop(state_->kept_by_use.begin()->second);
}

// Hidden ones are being written.
void ResultCache::CountOthers() {
  const std::lock_guard lock(state_->mutex);
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(state_->folder, none)) {
    const std::string name = entry.path().filename().string();
    if (state_->kept.contains(name) || name.starts_with("new_") || name.starts_with(".")) continue;
    std::error_code gone;
    const auto bytes = entry.file_size(gone);
    if (!gone) state_->Remember(name, int64_t(bytes));
  }
  state_->DropBeyondLimit("");
}

void ResultCache::DropOf(const std::string& start) {
  const std::lock_guard lock(state_->mutex);
  state_->gone.insert(start);
  for (auto next = state_->kept.lower_bound(start);
       next != state_->kept.end() && next->first.starts_with(start);) {
    const std::string name = (next++)->first;
    std::error_code ignored;
    fs::remove(state_->folder / name, ignored);
    state_->Forget(name);
  }
  std::error_code none;  // what another process has put there and nobody has asked for yet
  for (const auto& entry : fs::directory_iterator(state_->folder, none)) {
    std::error_code ignored;
    if (entry.path().filename().string().find(start) != std::string::npos) fs::remove(entry.path(), ignored);
  }
  for (auto next = state_->memory.lower_bound(start);
       next != state_->memory.end() && next->first.starts_with(start);) {
    const std::string name = (next++)->first;
    state_->ForgetInMemory(name);
  }
}

CacheFigures ResultCache::Figures() const {
  const std::lock_guard lock(state_->mutex);
  CacheFigures figures = state_->figures;
  figures.files = int64_t(state_->kept.size());
  return figures;
}

}  // namespace kvx
