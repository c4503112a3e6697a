// Indices are handed out by an atomic counter.
#include "core/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace kvx {
namespace {

constexpr size_t kRangesPerProcessor = 4;  // some take longer than others

size_t Processors() { return std::max(1u, std::thread::hardware_concurrency()); }

}  // namespace

void ParallelFor(size_t count, const std::function<void(size_t)>& body, int threads) {
  std::atomic<size_t> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (size_t i = next++; i < count; i = next++) body(i);
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  std::vector<std::jthread> others;
  const size_t wanted = std::min(count, threads > 0 ? size_t(threads) : Processors());
  for (size_t t = 1; t < wanted; ++t) others.emplace_back(work);
  work();
  others.clear();  // joins
  if (failure) std::rethrow_exception(failure);
}

void ParallelRanges(size_t count, const std::function<void(size_t, size_t)>& body) {
  const size_t ranges = std::clamp<size_t>(count, 1, kRangesPerProcessor * Processors());
  const size_t share = (count + ranges - 1) / ranges;
  ParallelFor(ranges, [&](size_t r) {
    if (r * share < count) body(r * share, std::min(count, (r + 1) * share));
  });
}

}  // namespace kvx
