// Loops over host threads, for work that is not worth a kernel. Every index writes only its own result, so
// the number of threads cannot show. The first exception stops
// the loop and is thrown again on the caller's thread.
#pragma once
#include <cstddef>
#include <functional>

namespace kvx {

// Calls body(0) ... body(count - 1), each once, on up to `threads` threads (0: all processors).
void ParallelFor(size_t count, const std::function<void(size_t)>& body, int threads = 0);

// Calls body(begin, end) on disjoint ranges that cover 0..count, one per processor.
void ParallelRanges(size_t count, const std::function<void(size_t begin, size_t end)>& body);

}  // namespace kvx
