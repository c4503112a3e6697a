// Host threads for loops that are not worth a kernel.
#include "pipeline/registration/parallel.h"

#include <algorithm>
#include <exception>
#include <thread>
#include <vector>

namespace kvx {

void ParallelRanges(size_t count, const std::function<void(size_t, size_t)>& body) {
  const size_t threads = std::clamp<size_t>(std::thread::hardware_concurrency(), 1, std::max<size_t>(1, count));
  const size_t share = (count + threads - 1) / threads;
  std::vector<std::exception_ptr> failures(threads);
  std::vector<std::jthread> workers;
  for (size_t t = 0; t < threads; ++t) {
    workers.emplace_back([&, t] {
      try {
        if (t * share < count) body(t * share, std::min(count, (t + 1) * share));
      } catch (...) {
        failures[t] = std::current_exception();
      }
    });
  }
  workers.clear();  // joins
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
}

}  // namespace kvx
