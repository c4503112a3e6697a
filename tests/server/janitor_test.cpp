// What a round of the janitor leaves behind it.
#include "server/janitor.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "server/log.h"
#include "tests/support/handler_requests.h"

namespace kvx {
namespace {
using namespace testing_support;

bool WaitUntil(const std::function<bool()>& met) {
  for (int n = 0; n < 1000 && !met(); ++n) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return met();
}

// A service that was killed between a removal's records and its bytes, and started again.
TEST(Janitor, RemovesBytesThatARemovalLeft) {
  SetLogLevel("off");
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  ASSERT_EQ(w.FilesUnder("blobs"), 3u);
  w.retention.DeleteSubject(subject, "-", "default");
  ASSERT_EQ(w.FilesUnder("blobs"), 3u);
  const Janitor janitor(w.services);
  EXPECT_TRUE(WaitUntil([&] { return w.FilesUnder("blobs") == 0u; }));
}

}  // namespace
}  // namespace kvx
