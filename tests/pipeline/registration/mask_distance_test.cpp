// Distances against brute force on an anisotropic grid.
#include "pipeline/registration/mask_distance.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {

TEST(DistanceMm, IsTheLeastDistanceToTheSet) {
  Mask set(testing_support::ObliqueGrid());
  std::mt19937 random(11);
  for (uint8_t& value : set.values) value = random() % 97 == 0;
  const Volume distance = DistanceMm(set);
  for (size_t v = 0; v < set.values.size(); v += 13) {
    double least = 1e9;
    for (size_t u = 0; u < set.values.size(); ++u) {
      if (!set.values[u]) continue;
      const Eigen::Vector3d gap =
          (set.grid.Ijk(u) - set.grid.Ijk(v)).cast<double>().cwiseProduct(set.grid.spacing_mm);
      least = std::min(least, gap.norm());
    }
    ASSERT_NEAR(distance.values[v], least, 1e-4) << "voxel " << v;
  }
}

TEST(DistanceMm, OfNothingIsFar) {
  for (const float value : DistanceMm(Mask(testing_support::ObliqueGrid())).values) ASSERT_GT(value, 1e5f);
}

}  // namespace
}  // namespace kvx
