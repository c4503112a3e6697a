// The nearest marked voxel, against trying all.
#include "core/voxels/nearest_voxel.h"

#include <gtest/gtest.h>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

void ExpectWhatTryingAllFinds(const Mask& mask) {
  const Grid& grid = mask.grid;
  const std::vector<uint32_t> nearest = NearestMarked(mask);
  const auto away = [&](size_t a, size_t b) {
    return (grid.Ijk(a) - grid.Ijk(b)).cast<double>().cwiseProduct(grid.spacing_mm).norm();
  };
  for (size_t v = 0; v < mask.values.size(); ++v) {
    double least = 1e9;
    for (size_t m = 0; m < mask.values.size(); ++m) {
      if (mask.values[m]) least = std::min(least, away(v, m));
    }
    ASSERT_EQ(mask.values[nearest[v]], 1);
    ASSERT_NEAR(away(v, nearest[v]), least, 1e-5);
  }
}

TEST(NearestMarked, AgreesWithTryingAll) {
  Mask mask(ObliqueGrid({9, 7, 6}));
  for (const size_t v : {3u, 100u, 222u, 301u, 377u}) mask.values[v] = 1;
  ExpectWhatTryingAllFinds(mask);
}

// More lines side by side than are taken at a time; rows without a marked voxel, and one of nothing else.
TEST(NearestMarked, AgreesWithTryingAllAlongManyLines) {
  Mask mask(ObliqueGrid({37, 9, 8}));
  for (size_t v = 0; v < mask.values.size(); ++v) {
    const Eigen::Vector3i p = mask.grid.Ijk(v);
    mask.values[v] = (p.y() == 2 && p.z() == 3) || (v * 7919 % 331 == 0 && p.y() != 5);
  }
  ExpectWhatTryingAllFinds(mask);
}

}  // namespace
}  // namespace kvx
