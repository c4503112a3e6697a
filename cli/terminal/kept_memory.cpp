// Thresholds of glibc's allocator, in bytes.
#include "cli/terminal/kept_memory.h"

#include <algorithm>
#include <cstdlib>  // says whether this is glibc
#include <thread>
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace kvx {

void KeepFreedMemory([[maybe_unused]] int largest_bytes) {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, largest_bytes);
  mallopt(M_TRIM_THRESHOLD, 1 << 29);  // bytes free at the end of the heap
  // What one thread freed, another takes; many threads would wait for each other.
  mallopt(M_ARENA_MAX, int(std::max(1u, std::thread::hardware_concurrency() / 2)));
#endif
}

}  // namespace kvx
