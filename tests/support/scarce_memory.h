// A process that gets hardly more memory than it has, nor threads, which need stacks: for death tests of the
// style "threadsafe", as other tests leave memory that would be taken again. Sanitizers take memory
// themselves.
#pragma once
#include <sys/resource.h>
#include <unistd.h>

#include <string>

#include "tests/support/fixtures.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define KVX_MEMORY_CAN_BE_SCARCE 0
#else
#define KVX_MEMORY_CAN_BE_SCARCE 1
#endif

namespace kvx::testing_support {

constexpr size_t kOneThread = size_t(14) << 20;  // room for the stack of one, not of two

inline void GetNoMoreMemoryThan(size_t more_bytes) {
  const rlim_t pages = rlim_t(std::stoll(Content("/proc/self/statm")));
  const rlim_t bytes = pages * rlim_t(::sysconf(_SC_PAGESIZE)) + more_bytes;
  const rlimit limit{bytes, bytes};
  ::setrlimit(RLIMIT_AS, &limit);
}

}  // namespace kvx::testing_support
