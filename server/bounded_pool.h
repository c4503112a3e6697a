// The HTTP threads: a fixed number, a bounded queue, and one thread that says 503 to what does not fit.
#pragma once
#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

#include "server/http_library.h"

namespace kvx {

class BoundedPool final : public httplib::TaskQueue {
 public:
  BoundedPool(int threads, size_t queue_limit);
  bool enqueue(std::function<void()> connection) override;  // false: not even room to say no
  void shutdown() override;

  // True on the thread that has to turn its connection away.
  static bool TurningAway();
  // True when connections wait for a thread like the calling one: those that have one should end after this request.
  static bool OthersWait();

 private:
  struct Lane {
    std::deque<std::function<void()>> waiting;
    size_t limit = 0;
    std::condition_variable arrived;
  };
  bool Push(Lane& lane, std::function<void()>& connection);
  void Serve(Lane& lane, bool turning_away);

  std::mutex mutex_;
  std::atomic<size_t> waiting_{0};
  bool stopping_ = false;
  Lane served_, turned_away_;
  std::vector<std::thread> threads_;
};

}  // namespace kvx
