// Pieces that were freed between pieces in use leave the process' memory.
#include "core/host/free_memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <vector>

namespace kvx {
namespace {

double ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  double all = 0, resident = 0;
  file >> all >> resident;
  return resident * double(sysconf(_SC_PAGESIZE));
}

TEST(FreeMemory, PiecesBetweenOthersGoBack) {
#if !defined(__GLIBC__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "another allocator";
#endif
  constexpr size_t kPieces = 1000, kBytes = 100'000, kKept = 50;
  std::vector<std::vector<char>> pieces(kPieces);
  for (auto& piece : pieces) piece.assign(kBytes, 'x');
  const double full = ResidentBytes();
  for (size_t n = 0; n < kPieces; ++n)
    if (n % kKept != 0) pieces[n] = std::vector<char>();
  ReturnFreeMemory();
  EXPECT_LT(ResidentBytes(), full - 0.8 * double(kPieces * kBytes));
  EXPECT_EQ(pieces[kKept].back(), 'x');
}

}  // namespace
}  // namespace kvx
