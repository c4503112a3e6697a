// Ends connections that are slow to say what they want, or to go: each holds a thread, and needs no token for
// that.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <mutex>

namespace kvx {

class ConnectionWatch {
 public:
  using Clock = std::chrono::steady_clock;
  explicit ConnectionWatch(std::chrono::seconds header_time) : header_time_(header_time) {}

 private:
  struct Entry {
    int socket;  // a second handle on it, ours: the number of one that was closed is soon another's
    bool turned_away;
    Clock::time_point began, until;      // of what the client has to do
    bool served = false, ended = false;  // served: it waits for us
  };
  struct Here {
    ConnectionWatch* watch = nullptr;
    Entry* entry = nullptr;
    bool left = false;
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
    Request() = default;
    ~Request();  // ends the connection when it is to leave
    Request(const Request&) = delete;
    Request& operator=(const Request&) = delete;

    // It was let in, and has the time that it takes. Who is not `known` has to take its answer swiftly.
    void Serve(bool known);
    void Answer(size_t bytes);           // what comes now, to whom nobody knows
    void ForgoBody(uint64_t announced);  // 0 where nobody knows
    bool ForgoesBody() const { return forgoes_; }
    void Leave(const void* tls) { leaves_ = true, tls_ = tls; }  // with the answer; its TLS session or null

   private:
    void End(int socket) const;
    bool known_ = false, forgoes_ = false, discards_ = false, leaves_ = false;
    const void* tls_ = nullptr;
  };

  // Whether the connection of this thread has ended with an answer: what is read of it now is no request, but
  // part of a body that somebody may have made up to look like one.
  static bool Left() { return here_.left; }
  // Tells, on any thread until the request ends, whether the client of this thread's connection has closed
  // it. The library asks whether there is nothing to read: of one that leaves TLS there is its goodbye.
  static std::function<bool()> ClientGone();

  // On the thread that accepts connections, often: ends those that took too long, and, where others wait for
  // a thread, the oldest that are slow.
  void EndSlow(size_t waiting);
  void EndAll();  // on that thread
  int Served() const;

 private:
  void Restart(Entry& entry, Clock::duration time) const;
  static void End(Entry& entry);
  static thread_local Here here_;
  const std::chrono::seconds header_time_;
  mutable std::mutex mutex_;
  std::list<Entry> entries_;
};

}  // namespace kvx
