// Shutting a socket down wakes the thread that reads it, which then closes it.
#include "server/http/connection_watch.h"

#include <fcntl.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <vector>

#include "server/http/bounded_pool.h"

namespace kvx {
namespace {

constexpr auto kPatience = std::chrono::seconds(2);  // with those in whose place others could be served
constexpr auto kTurnedAwayPatience = std::chrono::milliseconds(500);
constexpr size_t kSlowestReader = 16 << 10;             // bytes a second
constexpr uint64_t kMostDiscarded = uint64_t(1) << 30;  // of a body; whoever sends more has to read meanwhile

}  // namespace

thread_local ConnectionWatch::Here ConnectionWatch::here_;

ConnectionWatch::Connection::Connection(ConnectionWatch& watch, int socket) : watch_(watch) {
  const std::lock_guard lock(watch.mutex_);
  watch.entries_.push_back({::fcntl(socket, F_DUPFD_CLOEXEC, 0), BoundedPool::TurningAway(), {}, {}});
  entry_ = std::prev(watch.entries_.end());
  watch.Restart(*entry_, watch.header_time_);
  here_ = {&watch, &*entry_, false};
}

ConnectionWatch::Connection::~Connection() {
  const std::lock_guard lock(watch_.mutex_);
  if (entry_->socket >= 0) ::close(entry_->socket);
  watch_.entries_.erase(entry_);
  here_ = {};
}

void ConnectionWatch::Restart(Entry& entry, Clock::duration time) const {
  entry.served = false;
  entry.began = Clock::now();
  entry.until = entry.began + time;
}

void ConnectionWatch::Request::Serve(bool known) {
  known_ = known;
  if (!here_.watch) return;
  const std::lock_guard lock(here_.watch->mutex_);
  here_.entry->served = true;
}

void ConnectionWatch::Request::Answer(size_t bytes) {
  if (!here_.watch || known_) return;
  const std::lock_guard lock(here_.watch->mutex_);
  here_.watch->Restart(*here_.entry,
                       here_.watch->header_time_ + std::chrono::seconds(bytes / kSlowestReader));
}

void ConnectionWatch::Request::ForgoBody(uint64_t announced) {
  forgoes_ = true;
  discards_ = announced <= kMostDiscarded;
}

ConnectionWatch::Request::~Request() {
  if (!here_.watch) return;
  const int socket = here_.entry->socket;
  {
    const std::lock_guard lock(here_.watch->mutex_);
    here_.watch->Restart(*here_.entry, here_.watch->header_time_);
  }
  if (!leaves_) return;
  here_.left = true;
  End(socket);
}

// RFC 9112, 9.6: what is closed while bytes come is reset, and the client may lose its answer. So they are
// taken until the client closes too, or its time is up.
void ConnectionWatch::Request::End(int socket) const {
  if (tls_) {
    SSL_shutdown(static_cast<SSL*>(const_cast<void*>(tls_)));
    ERR_clear_error();
  }
  ::shutdown(socket, SHUT_WR);
  char bytes[16 << 10];
  while (discards_ && ::recv(socket, bytes, sizeof bytes, 0) > 0) {
  }
  ::shutdown(socket, SHUT_RDWR);
}

std::function<bool()> ConnectionWatch::ClientGone() {
  if (!here_.watch) return [] { return false; };
  return [socket = here_.entry->socket] {
    pollfd look{.fd = socket, .events = POLLRDHUP, .revents = 0};
    return ::poll(&look, 1, 0) > 0;
  };
}

void ConnectionWatch::End(Entry& entry) {
  entry.ended = true;
  ::shutdown(entry.socket, SHUT_RDWR);
}

void ConnectionWatch::EndSlow(size_t waiting) {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  std::vector<Entry*> in_the_way;
  for (Entry& entry : entries_) {
    if (entry.served || entry.ended) continue;
    const auto took = now - entry.began;
    if (now > entry.until || (entry.turned_away && took > kTurnedAwayPatience))
      End(entry);
    else if (took > kPatience)
      in_the_way.push_back(&entry);
  }
  std::ranges::sort(in_the_way, {}, &Entry::began);
  in_the_way.resize(std::min(in_the_way.size(), waiting));
  for (Entry* entry : in_the_way) End(*entry);
}

void ConnectionWatch::EndAll() {
  const std::lock_guard lock(mutex_);
  for (Entry& entry : entries_)
    if (!entry.ended) End(entry);
}

int ConnectionWatch::Served() const {
  const std::lock_guard lock(mutex_);
  return int(std::ranges::count_if(entries_, [](const Entry& entry) { return entry.served; }));
}

}  // namespace kvx
