// Indices are handed out by an atomic counter to threads that oneTBB keeps: thousands of short loops a second
// are not worth new threads each.
#include "core/host/parallel.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <exception>
#include <future>
#include <mutex>
#include <system_error>

namespace kvx {
namespace {

constexpr size_t kRangesPerProcessor = 4;  // some take longer than others
constexpr size_t kCopiedBytes = 1 << 20;   // by one thread at a time
constexpr size_t kTouchedBytes = 4 << 20;
constexpr size_t kLeastPage = 4096;  // of the systems that there are
constexpr auto kMostThreads = tbb::global_control::max_allowed_parallelism;

size_t Processors() {
  return std::min(size_t(tbb::this_task_arena::max_concurrency()),
                  tbb::global_control::active_value(kMostThreads));
}

// Calls work(0) ... work(count - 1), each on a thread of its own where there are enough.
void OnThreads(size_t count, const std::function<void(size_t)>& work) {
#ifdef __SANITIZE_THREAD__
  // The sanitizer does not see how threads of oneTBB wait for each other, which is not built for it.
  std::vector<std::future<void>> threads;
  for (size_t t = 0; t < count; ++t) threads.push_back(std::async(std::launch::async, work, t));
  for (std::future<void>& thread : threads) thread.get();
#else
  // Isolated: a thread that waits for the others here takes up no work of a loop outside, whose locks it may
  // hold.
  tbb::this_task_arena::isolate(
      [&] { tbb::parallel_for(size_t(0), count, work, tbb::simple_partitioner()); });
#endif
}

// As Processors() threads of oneTBB and this one, each of which waits for the others.
void MeetOnThreads() {
  constexpr auto kPatience = std::chrono::seconds(2);  // a machine with much to do has started them by then
  std::mutex mutex;
  std::condition_variable changed;
  const size_t all = Processors();
  size_t here = 0;
  OnThreads(all, [&](size_t) {
    std::unique_lock lock(mutex);
    if (++here == all) changed.notify_all();
    changed.wait_for(lock, kPatience, [&] { return here >= all; });
  });
}

// Nothing where the system gives no thread.
std::future<void> Begun(const std::function<void()>& work) try {
  return std::async(std::launch::async, work);
} catch (const std::system_error&) {
  return {};
}

}  // namespace

std::shared_ptr<const void> LimitThreads(int threads) {
  return std::make_shared<const tbb::global_control>(kMostThreads, size_t(std::max(1, threads)));
}

void StartThreads() {
  if (Processors() > 1) MeetOnThreads();
}

// No failure passes through oneTBB: it would end, without a word, the loops that other threads run inside
// this one. It fails itself where it gets no thread, when what has begun has ended.
void ParallelFor(size_t count, const std::function<void(size_t)>& body, int threads) {
  std::atomic<size_t> next = 0;
  std::exception_ptr failure;
  std::once_flag failed;
  const auto work = [&](size_t) {
    try {
      for (size_t i = next++; i < count; i = next++) body(i);
    } catch (...) {
      next = count;
      std::call_once(failed, [&] { failure = std::current_exception(); });
    }
  };
  const size_t wanted = std::min(count, threads > 0 ? size_t(threads) : Processors());
  try {
    if (wanted > 1) OnThreads(wanted, work);
  } catch (const std::exception&) {
  }
  work(0);  // what is left
  if (failure) std::rethrow_exception(failure);
}

void ParallelRanges(size_t count, const std::function<void(size_t, size_t)>& body) {
  const size_t ranges = std::clamp<size_t>(count, 1, kRangesPerProcessor * Processors());
  const size_t share = (count + ranges - 1) / ranges;
  ParallelFor(ranges, [&](size_t r) {
    if (r * share < count) body(r * share, std::min(count, (r + 1) * share));
  });
}

// Not on a thread that oneTBB keeps: while that waited for its own loops, it would not help with the others'.
void SideBySide(const std::function<void()>& first, const std::function<void()>& second) {
  std::future<void> beside = Processors() < 2 ? std::future<void>() : Begun(second);
  if (!beside.valid()) return first(), second();
  try {
    first();
  } catch (...) {
    beside.wait();
    throw;
  }
  beside.get();
}

void ParallelTouch(void* memory, size_t bytes) {
  if (bytes <= kTouchedBytes) return;
  const size_t blocks = (bytes + kTouchedBytes - 1) / kTouchedBytes;
  ParallelFor(blocks, [&](size_t b) {
    char* const first = static_cast<char*>(memory) + b * kTouchedBytes;
    const size_t here = std::min(kTouchedBytes, bytes - b * kTouchedBytes);
    for (size_t at = 0; at < here; at += kLeastPage) first[at] = 0;
  });
}

void ParallelCopy(void* to, const void* from, size_t bytes) {
  if (bytes == 0) return;
  if (bytes <= kCopiedBytes) return void(std::memcpy(to, from, bytes));
  const size_t blocks = (bytes + kCopiedBytes - 1) / kCopiedBytes;
  ParallelFor(blocks, [&](size_t b) {
    const size_t begin = b * kCopiedBytes;
    std::memcpy(static_cast<char*>(to) + begin, static_cast<const char*>(from) + begin,
                std::min(kCopiedBytes, bytes - begin));
  });
}

}  // namespace kvx
