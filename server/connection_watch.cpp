// Shutting a socket down wakes the thread that reads it, which then closes it.
#include "server/connection_watch.h"

#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <vector>

#include "server/bounded_pool.h"

namespace kvx {
namespace {

constexpr auto kPatience = std::chrono::seconds(2);  // with those in whose place others could be served
constexpr auto kTurnedAwayPatience = std::chrono::milliseconds(500);

struct Current {
  std::mutex* mutex = nullptr;
  bool* in_header = nullptr;
  ConnectionWatch::Clock::time_point* header_began = nullptr;
};
thread_local Current current_here;

ino_t InodeOf(int socket) {
  struct stat facts {};
  return ::fstat(socket, &facts) == 0 && S_ISSOCK(facts.st_mode) ? facts.st_ino : 0;
}

}  // namespace

ConnectionWatch::Connection::Connection(ConnectionWatch& watch, int socket) : watch_(watch) {
  const std::lock_guard lock(watch.mutex_);
  watch.entries_.push_back({socket, InodeOf(socket), Clock::now(), BoundedPool::TurningAway()});
  entry_ = std::prev(watch.entries_.end());
  current_here = {&watch.mutex_, &entry_->in_header, &entry_->header_began};
}

ConnectionWatch::Connection::~Connection() {
  const std::lock_guard lock(watch_.mutex_);
  watch_.entries_.erase(entry_);
  current_here = {};
}

void ConnectionWatch::Request::Mark(bool in_header) {
  const Current& current = current_here;
  if (!current.mutex) return;
  const std::lock_guard lock(*current.mutex);
  *current.in_header = in_header;
  *current.header_began = Clock::now();
}

// Its thread may have closed it a moment ago. No connection can have its number since: this thread accepts.
void ConnectionWatch::End(Entry& entry) {
  entry.ended = true;
  if (entry.inode != 0 && InodeOf(entry.socket) == entry.inode) ::shutdown(entry.socket, SHUT_RDWR);
}

void ConnectionWatch::EndSlow(size_t waiting) {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  std::vector<Entry*> in_the_way;
  for (Entry& entry : entries_) {
    if (!entry.in_header || entry.ended) continue;
    const auto took = now - entry.header_began;
    if (took > header_time_ || (entry.turned_away && took > kTurnedAwayPatience))
      End(entry);
    else if (took > kPatience)
      in_the_way.push_back(&entry);
  }
  std::ranges::sort(in_the_way, {}, &Entry::header_began);
  in_the_way.resize(std::min(in_the_way.size(), waiting));
  for (Entry* entry : in_the_way) End(*entry);
}

}  // namespace kvx
