// Warp and its CPU twin against what trilinear interpolation of a linear ramp must give.
#include "kernels/warp.h"

#include <gtest/gtest.h>

#include "kernels/reference/warp.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

const RigidTransform kMotion = Exp((Twist() << 0.05, 0.1, -0.08, 0.9, -0.4, 0.7).finished());

void ExpectRampInside(const Volume& warped, const LinearRamp& ramp, const Grid& moving) {
  size_t inside = 0;
  for (size_t v = 0; v < warped.values.size(); ++v) {
    const PointMm x = kMotion * warped.grid.ToMm(PointVox{warped.grid.Ijk(v).cast<double>()});
    const Eigen::Vector3d p = moving.ToVox(x).ijk;
    const bool clear =
        (p.array() > 1e-3).all() && (p.array() < (moving.size.array() - 1).cast<double>() - 1e-3).all();
    if (!clear) continue;
    ++inside;
    ASSERT_NEAR(warped.values[v], ramp.At(x), 1e-3) << "voxel " << v;
  }
  EXPECT_GT(inside, warped.values.size() / 3);
}

TEST(Warp, RigidMotionOfALinearRampIsExact) {
  const LinearRamp ramp;
  const Grid grid = ObliqueGrid();
  const Mask all(grid, 1);
  ExpectRampInside(Warp(SharedBackend())(ramp.On(grid), FieldOf(kMotion, grid), all), ramp, grid);
  ExpectRampInside(reference::Warp(ramp.On(grid), FieldOf(kMotion, grid), all), ramp, grid);
}

TEST(Warp, OutsideTheMovingGridIsTheOutsideValue) {
  const Grid grid = ObliqueGrid();
  const RigidTransform far{Eigen::Quaterniond::Identity(), {1000, 0, 0}};
  const Volume warped =
      Warp(SharedBackend())(LinearRamp{}.On(grid), FieldOf(far, grid), Mask(grid, 1), -7.0f);
  for (const float value : warped.values) ASSERT_EQ(value, -7.0f);
}

TEST(Warp, WhatIsNotWantedIsTheOutsideValueAndTheRestAsEver) {
  const Grid grid = ObliqueGrid();
  const Volume ramp = LinearRamp{}.On(grid);
  const DisplacementField field = FieldOf(kMotion, grid);
  Mask some(grid, 0);
  for (size_t v = 0; v < some.values.size(); v += 3) some.values[v] = 1;
  const Volume whole = Warp(SharedBackend())(ramp, field, Mask(grid, 1), -7.0f),
               part = Warp(SharedBackend())(ramp, field, some, -7.0f),
               twin = reference::Warp(ramp, field, some, -7.0f);
  for (size_t v = 0; v < part.values.size(); ++v) {
    ASSERT_EQ(part.values[v], some.values[v] ? whole.values[v] : -7.0f);
    ASSERT_TRUE(some.values[v] || twin.values[v] == -7.0f);
  }
}

TEST(ProgramCache, ASecondBackendFindsTheBinaryOnDisk) {
  const ScratchFolder folder;
  const BackendOptions options{.cache = folder.path()};
  Backend first(options), second(options);
  Warp a(first);
  EXPECT_EQ(first.programs().compiled_count(), 1);
  Warp b(second);
  EXPECT_EQ(second.programs().compiled_count(), 0);
  const Grid grid = ObliqueGrid();
  EXPECT_EQ(a(LinearRamp{}.On(grid), FieldOf(kMotion, grid), Mask(grid, 1)).values,
            b(LinearRamp{}.On(grid), FieldOf(kMotion, grid), Mask(grid, 1)).values);
}

// Where a voxel lands on the border it must not depend on rounding whether it counts.
TEST(Warp, NothingIsLostAtTheBorderByRounding) {
  const Grid grid = ObliqueGrid({40, 36, 32});
  const Volume ones(grid, 1.0f);
  const auto lost_with = [&](double voxels) {
    const RigidTransform shift{Eigen::Quaterniond::Identity(),
                               grid.MmFromVox() * Eigen::Vector3d(voxels, 0, 0)};
    const DisplacementField field = FieldOf(shift, grid);
    const Mask all(grid, 1);
    const Volume device = Warp(SharedBackend())(ones, field, all), twin = reference::Warp(ones, field, all);
    EXPECT_EQ(device.values, twin.values);
    return std::count(device.values.begin(), device.values.end(), 0.0f);
  };
  EXPECT_EQ(lost_with(0), 0);
  EXPECT_EQ(lost_with(0.01), 36 * 32);
  EXPECT_EQ(lost_with(-0.01), 36 * 32);
}

}  // namespace
}  // namespace kvx
