// Ends connections that are slow to say what they want: each holds a thread, and needs no token for that.
#pragma once
#include <sys/types.h>

#include <chrono>
#include <list>
#include <mutex>

namespace kvx {

class ConnectionWatch {
 public:
  using Clock = std::chrono::steady_clock;
  explicit ConnectionWatch(std::chrono::seconds header_time) : header_time_(header_time) {}

 private:
  struct Entry {
    int socket;
    ino_t inode;  // the number of a socket is soon another's
    Clock::time_point header_began;
    bool turned_away, in_header = true, ended = false;
  };

 public:
  // On a connection's thread, for as long as it lives.
  class Connection {
   public:
    Connection(ConnectionWatch& watch, int socket);
    ~Connection();
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

   private:
    ConnectionWatch& watch_;
    std::list<Entry>::iterator entry_;
  };
  // On a connection's thread, from the end of a header to the end of the answer. Nothing where no connection
  // is watched.
  class Request {
   public:
    Request() { Mark(false); }
    ~Request() { Mark(true); }
    Request(const Request&) = delete;
    Request& operator=(const Request&) = delete;

   private:
    static void Mark(bool in_header);
  };

  // On the thread that accepts connections, often: ends those whose header took too long, and, where others
  // wait for a thread, the oldest that are still in theirs.
  void EndSlow(size_t waiting);

 private:
  static void End(Entry& entry);
  const std::chrono::seconds header_time_;
  std::mutex mutex_;
  std::list<Entry> entries_;
};

}  // namespace kvx
