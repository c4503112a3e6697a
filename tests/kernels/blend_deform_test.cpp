// The blend kernel against core/blend.h, through the guard as well.
#include "kernels/blend_deform.h"

#include <gtest/gtest.h>

#include "core/blend.h"
#include "kernels/reference/blend_deform.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// Weights slide from one bone to the next along each axis.
WeightMap Sliding(const Grid& grid) {
  WeightMap map(grid);
  for (size_t v = 0; v < map.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v);
    const float a = float(p.x()) / float(grid.size.x() - 1), b = float(p.y()) / float(grid.size.y() - 1);
    map.values[v] = {{2, 0, 1, 3}, {a * b, (1 - a) * b, a * (1 - b), (1 - a) * (1 - b)}};
    if (p.z() == 0) map.values[v] = {{1, 1, 1, 1}, {1, 0, 0, 0}};
  }
  return map;
}

TEST(BlendField, AgreesWithItsTwin) {
  Grid grid = ObliqueGrid();
  grid.origin.lps = {-700, 1200, 900};  // far from the world's origin, as scanners have it
  const PointMm centre = grid.ToMm(8, 6, 5);
  const PoseVector pose = {{},
                           RotationAbout(centre, {0, 0, 1}, RadFromDeg(175)),
                           RotationAbout(centre, {1, 2, 0}, RadFromDeg(120)),
                           Exp((Twist() << 0.1, 0.2, -0.3, 4, 5, 6).finished())};
  const WeightMap weights = Sliding(grid);
  size_t guarded = 0;
  for (const VoxelWeights& w : weights.values)
    guarded += std::abs(Blend(w, pose).leftCols<3>().determinant() - 1) < 1e-9;
  EXPECT_GT(guarded, size_t(grid.size.x() * grid.size.y()));  // more than the rigid slice
  const DisplacementField device = BlendField(SharedBackend())(weights, pose);
  const DisplacementField twin = reference::BlendField(weights, pose);
  for (size_t v = 0; v < twin.values.size(); ++v) {
    ASSERT_LT((device.values[v] - twin.values[v]).norm(), 1e-3) << "voxel " << v;
  }
}

TEST(BlendField, OneMotionForAllIsThatMotion) {
  const Grid grid = ObliqueGrid();
  const RigidTransform motion = Exp((Twist() << 0.3, -0.2, 0.1, 5, 6, 7).finished());
  const DisplacementField field = BlendField(SharedBackend())(Sliding(grid), PoseVector(4, motion));
  const DisplacementField expected = FieldOf(motion, grid);
  for (size_t v = 0; v < field.values.size(); ++v) {
    ASSERT_LT((field.values[v] - expected.values[v]).norm(), 1e-3) << "voxel " << v;
  }
}

}  // namespace
}  // namespace kvx
