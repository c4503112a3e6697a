// Loops over host threads, for work that is not worth a kernel. Every index writes only its own result, so
// the number of threads cannot show. The first exception stops
// the loop and is thrown again on the caller's thread.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

namespace kvx {

// As long as the result lives, a loop runs on at most `threads` threads (of several limits, the least).
std::shared_ptr<const void> LimitThreads(int threads);

// Has all threads that loops may use, which stay while the calling one does. Where the system gives one of
// oneTBB's own no thread, the program ends: better before it has taken up any work.
void StartThreads();

// Calls body(0) ... body(count - 1), each once, on up to `threads` threads (0: all processors).
void ParallelFor(size_t count, const std::function<void(size_t)>& body, int threads = 0);

// Calls body(begin, end) on disjoint ranges that cover 0..count, a few per processor.
void ParallelRanges(size_t count, const std::function<void(size_t begin, size_t end)>& body);

// Calls body(0) ... body(count - 1), each once: as ParallelFor, for many small bodies.
template <class Body>
void ParallelEach(size_t count, const Body& body) {
  ParallelRanges(count, [&](size_t begin, size_t end) {
    for (size_t index = begin; index < end; ++index) body(index);
  });
}

// Calls both, the second on a thread of its own beside the first; one after the other where loops may have
// only one thread, or there is none to be had. Returns when both have ended. What the first throws goes
// before what the second throws.
void SideBySide(const std::function<void()>& first, const std::function<void()>& second);

// As memcpy, for memory that nobody touched before: the system hands it out page by page, which takes longer.
void ParallelCopy(void* to, const void* from, size_t bytes);

// Has the system hand out the pages of memory that nobody has written to, for whoever fills it next.
void ParallelTouch(void* memory, size_t bytes);

// `count` times the value.
template <class T>
std::vector<T> Filled(size_t count, const T& value) {
  std::vector<T> out;
  out.reserve(count);
  ParallelTouch(out.data(), count * sizeof(T));
  out.resize(count, value);
  return out;
}

// What collect(list, part) appends to a list for every part of 0..parts, those of one part after the other's.
template <class T, class Collect>
std::vector<T> ParallelCollect(size_t parts, const Collect& collect) {
  std::vector<std::vector<T>> lists(parts);
  ParallelFor(parts, [&](size_t part) { collect(lists[part], part); });
  size_t count = 0;
  for (const std::vector<T>& list : lists) count += list.size();
  std::vector<T> all;
  all.reserve(count);
  for (const std::vector<T>& list : lists) all.insert(all.end(), list.begin(), list.end());
  return all;
}

// A Sum that add(sum, index) has been called on for every index of 0..count, added up with +=. In parts whose
// number is fixed, so that rounding does not depend on the number of threads.
template <class Sum, class Add>
Sum ParallelSum(size_t count, const Add& add) {
  constexpr size_t kParts = 16;
  const size_t share = (count + kParts - 1) / kParts;
  std::array<Sum, kParts> parts{};
  ParallelFor(kParts, [&](size_t p) {
    Sum part{};
    for (size_t index = p * share; index < std::min(count, (p + 1) * share); ++index) add(part, index);
    parts[p] = part;
  });
  Sum all = parts[0];
  for (size_t p = 1; p < kParts; ++p) all += parts[p];
  return all;
}

}  // namespace kvx
