// Whether the disk keeps its reserve, asked before and while bytes come: nobody needs to say how many will.
#pragma once
#include "api/errors.h"
#include "api/services.h"

namespace kvx {

// Drops results where that makes the room: they can be made again.
inline bool HasRoom(const Services& services, int64_t more_bytes) {
  if (services.has_room(more_bytes)) return true;
  services.results.MakeRoom(more_bytes);
  return services.has_room(more_bytes);
}

inline void RequireRoom(const Services& services, int64_t more_bytes) {
  if (HasRoom(services, more_bytes)) return;
  throw DiskNearlyFull(
      "the service's disk is nearly full: it takes no uploads and no jobs until its operator makes room; "
      "removing subjects and asking for what is there go on");
}

class RoomWatch {
 public:
  explicit RoomWatch(const Services& services) : services_(services) {}
  void Wrote(size_t bytes) {  // throws DiskNearlyFull
    since_look_ += bytes;
    if (since_look_ < kLookEvery) return;
    since_look_ = 0;
    RequireRoom(services_, 0);
  }

 private:
  static constexpr size_t kLookEvery = size_t(64) << 20;
  const Services& services_;
  size_t since_look_ = 0;
};

}  // namespace kvx
