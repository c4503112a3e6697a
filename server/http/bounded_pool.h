// The HTTP threads: as many as there are connections, up to a limit; a bounded queue beyond, and a few
// threads that say 503 to what does not fit. A connection keeps its thread while it lives, so slow clients
// cost threads, which are cheap while they wait; what computes passes a gate first
// (server/turns/posing_gate.h).
#pragma once
#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <list>
#include <mutex>
#include <thread>
#include <vector>

#include "server/http_library.h"

namespace kvx {

class BoundedPool final : public httplib::TaskQueue {
 public:
  // `look`: called by the thread that accepts, with each connection and now and then, with how many wait for
  // a thread; in the end with the largest number, until all connections have ended.
  BoundedPool(int most_threads, size_t queue_limit, std::function<void(size_t waiting)> look = {});
  ~BoundedPool() override;                                  // as shutdown
  bool enqueue(std::function<void()> connection) override;  // false: not even room to say no
  void shutdown() override;
  void on_idle() override;

  // True on the thread that has to turn its connection away.
  static bool TurningAway();
  // True when connections wait for a thread like the calling one:
  // those that have one should end after this request.
  static bool OthersWait();

 private:
  struct Lane {
    std::deque<std::function<void()>> waiting;
    size_t limit = 0, most_threads = 0;
    size_t threads = 0, busy = 0;  // the others are about to take what waits
    std::condition_variable arrived;
  };
  bool Push(Lane& lane, std::function<void()>& connection, bool turning_away);
  bool Start(Lane& lane, bool turning_away);  // false where the system gives no more threads
  void Serve(Lane& lane, bool turning_away);
  void Look(size_t waiting) const;
  void AwaitEnd();
  void JoinEnded();
  void CountWaiting();  // those for whom no thread is free

  const std::function<void(size_t waiting)> look_;
  std::mutex mutex_;
  std::atomic<size_t> waiting_{0};
  bool stopping_ = false;
  std::condition_variable thread_ended_;
  Lane served_, turned_away_;
  std::list<std::thread> threads_;
  std::vector<std::thread::id> ended_;
};

}  // namespace kvx
