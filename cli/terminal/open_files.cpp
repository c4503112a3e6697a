// The soft limit goes up to the hard one, and no further than any service needs.
#include "cli/terminal/open_files.h"

#include <sys/resource.h>

#include <algorithm>

namespace kvx {

void AllowManyOpenFiles() {
  constexpr rlim_t kEnough = 65536;
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= kEnough) return;
  limit.rlim_cur = std::min(kEnough, limit.rlim_max);
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace kvx
