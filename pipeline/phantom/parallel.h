// Splits a loop over the machine's cores. Results must not depend on which thread runs which index.
#pragma once
#include <functional>

namespace kvx::phantom {

// Calls body(0) ... body(count - 1), each once, on up to `threads` threads (0: all cores). The first
// exception is thrown again here.
void ParallelFor(int count, const std::function<void(int)>& body, int threads = 0);

}  // namespace kvx::phantom
