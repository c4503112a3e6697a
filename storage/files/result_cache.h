// Computed files kept on disk, bounded in size, the least recently used dropped first.
// Each is made once, however many ask.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "core/host/asker.h"
#include "storage/files/cached_file.h"

namespace kvx {

struct CacheFigures {
  int64_t hits = 0, misses = 0, bytes = 0, files = 0;
  int64_t memory_bytes = 0;
};

class ResultCache {
 public:
  using Make = std::function<void(const std::filesystem::path&)>;

  // Whether the disk keeps its reserve when so many bytes more come.
  using HasRoom = std::function<bool(int64_t more_bytes)>;
  static constexpr int64_t kMemoryBytes = int64_t(256) << 20;  // of results, unless another limit is given

  // Takes over what the folder holds. The results used last are kept in memory as well. On the disk they are
  // kept up to the limit, and as long as there is room.
  ResultCache(
      std::filesystem::path folder, int64_t limit_bytes, int64_t memory_limit_bytes = kMemoryBytes,
      HasRoom has_room = [](int64_t) { return true; });
  ~ResultCache();

  // `name` says all that the bytes depend on, and the suffix: "<digest>.nii.gz". `make` writes the file at
  // the path it is given; what it throws reaches all who wait for this name.
  // Cancelled does not: one of them makes it then. Throws Cancelled when nobody listens to the one that waits
  // any more, Unavailable where too many wait already: of one project alone 64, of others half of what is
  // left.
  std::shared_ptr<const CachedFile> Get(const std::string& name, const Make& make, const Asker& asker = {});
  // The same for a result that is made in memory: it is sent from there, and stored on disk by and by.
  std::shared_ptr<const CachedFile> GetBytes(const std::string& name,
                                             const std::function<std::string()>& make,
                                             const Asker& asker = {});
  // Empty when it is not kept. Finds what another process has put into the folder, too.
  std::shared_ptr<const CachedFile> Find(const std::string& name);
  // Drops results until so many bytes more can come, unless all of them are too few for that.
  void MakeRoom(int64_t more_bytes);
  // Counts what other processes have put into the folder since.
  void CountOthers();
  // All whose names start so, those under way and those that another process has put into the folder, too.
  void DropOf(const std::string& start);
  CacheFigures Figures() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
