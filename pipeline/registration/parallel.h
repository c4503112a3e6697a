// Splits a loop over host threads. Every index is computed on its own, so results do not depend on the number of threads.
#pragma once
#include <functional>

namespace kvx {

// Calls body(begin, end) on disjoint ranges that cover 0..count.
void ParallelRanges(size_t count, const std::function<void(size_t begin, size_t end)>& body);

}  // namespace kvx
