// Thresholds of glibc's allocator, in bytes.
#include "cli/kept_memory.h"

#include <cstdlib>  // says whether this is glibc
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace kvx {

void KeepFreedMemory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 1 << 30);  // smaller blocks do not go back to the system one by one
  mallopt(M_TRIM_THRESHOLD, 1 << 29);  // nor together, until so much is free
#endif
}

}  // namespace kvx
