// What a service does at its start and now and then: takes jobs back from dead workers, drops uploads that
// nobody finished, bytes that nobody refers to and those of removed subjects that could not be removed
// before, counts the results of workers.
#pragma once
#include <condition_variable>
#include <mutex>
#include <thread>

#include "api/services.h"
#include "server/seldom_log.h"

namespace kvx {

class Janitor {
 public:
  explicit Janitor(Services& services);
  ~Janitor() { Stop(); }
  void Stop();

 private:
  void Run();
  void Round(int64_t number);
  Services& services_;
  SeldomLog seldom_;
  std::mutex mutex_;
  std::condition_variable asked_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace kvx
