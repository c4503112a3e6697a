// Indices are handed out by an atomic counter; a failure stops the hand-out.
#include "pipeline/phantom/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace kvx::phantom {

void ParallelFor(int count, const std::function<void(int)>& body, int threads) {
  std::atomic<int> next{0};
  std::mutex guard;
  std::exception_ptr failure;
  const auto work = [&] {
    for (int i = next++; i < count; i = next++) {
      try {
        body(i);
      } catch (...) {
        const std::lock_guard lock(guard);
        if (!failure) failure = std::current_exception();
        next = count;
      }
    }
  };
  const int cores = threads > 0 ? threads : std::max(1, int(std::thread::hardware_concurrency()));
  std::vector<std::thread> helpers;
  for (int t = 1; t < std::min(cores, count); ++t) helpers.emplace_back(work);
  work();
  for (std::thread& helper : helpers) helper.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace kvx::phantom
