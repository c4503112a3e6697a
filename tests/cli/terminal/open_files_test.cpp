// The limit of open files goes up as far as the system lets it.
#include "cli/terminal/open_files.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>

namespace kvx {
namespace {

TEST(OpenFiles, TheLimitIsRaisedAndNeverLowered) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const auto soft_after = [&](rlim_t soft) {
    rlimit limit{soft, before.rlim_max};
    ::setrlimit(RLIMIT_NOFILE, &limit);
    AllowManyOpenFiles();
    ::getrlimit(RLIMIT_NOFILE, &limit);
    EXPECT_EQ(limit.rlim_max, before.rlim_max);
    return limit.rlim_cur;
  };
  EXPECT_EQ(soft_after(256), std::min<rlim_t>(65536, before.rlim_max));
  EXPECT_EQ(soft_after(before.rlim_max), before.rlim_max);
  ::setrlimit(RLIMIT_NOFILE, &before);
}

}  // namespace
}  // namespace kvx
