// A limb in noisy air: a bone of marrow and cortex in muscle, fat and skin around.
#include "pipeline/segmentation/mr/levels/muscle_level.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace kvx {
namespace {

constexpr double kMarrow = 200;

struct World {
  Volume scan;
  LabelMap strokes;
};

// In mm from the limb's axis, a cylinder along i: the limb's skin 34, muscle within 28, cortex within 12,
// marrow within 9. In parts of marrow.
double Tissue(double from_axis, double muscle) {
  if (from_axis < 9) return 1;
  if (from_axis < 12) return 0.03;
  if (from_axis < 28) return muscle;
  if (from_axis < 32) return 1.3;
  return from_axis < 34 ? 0.2 : 0;
}

// Rician noise, in parts of marrow. `masked`: the view's corners are 0.
World MakeWorld(double muscle, double noise, bool masked = false) {
  Grid grid;
  grid.size = {40, 42, 42}, grid.spacing_mm = {2, 2, 2};
  World world{Volume(grid), LabelMap(grid)};
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, noise);
  for (size_t v = 0; v < world.scan.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v);
    const double from_axis = 2 * std::hypot(p.y() - 20.5, p.z() - 20.5);
    const double tissue = Tissue(from_axis, muscle) + normal(random);
    world.scan.values[v] = float(kMarrow * std::hypot(tissue, normal(random)));
    if (masked && from_axis > 46) world.scan.values[v] = 0;
    if (from_axis < 6 && p.x() > 8 && p.x() < 32 && p.x() % 4 == 0) world.strokes.values[v] = 3;
    if (from_axis > 29 && from_axis < 31) world.strokes.values[v] = 255;
  }
  return world;
}

TEST(MuscleLevel, IsReadInNoiseAndBesideMaskedAir) {
  for (const double muscle : {0.12, 0.25, 0.5}) {
    for (const bool masked : {false, true}) {
      const World world = MakeWorld(muscle, 0.02, masked);
      EXPECT_NEAR(MuscleLevel(world.scan, world.strokes).value(), muscle, 0.02 + 0.04 * muscle);
    }
  }
}

TEST(MuscleLevel, AirAndCortexAreNone) {
  World world = MakeWorld(1.3, 0.03);  // fat up to the bone
  EXPECT_FALSE(MuscleLevel(world.scan, world.strokes));
}

TEST(MuscleLevel, WithoutStrokesOfABoneThereIsNone) {
  World world = MakeWorld(0.5, 0);
  for (uint16_t& stroke : world.strokes.values) stroke = stroke == 3 ? 0 : stroke;
  EXPECT_FALSE(MuscleLevel(world.scan, world.strokes));
}

TEST(WithUsualMuscle, AUsualScanStaysAsItIs) {
  const World world = MakeWorld(0.5, 0.03);
  const UsualMuscle usual = WithUsualMuscle(world.scan, world.strokes);
  EXPECT_TRUE(usual.scan.lent());
  EXPECT_EQ(usual.darker, 0);
}

// In proportion up to muscle; from marrow on nothing changes.
TEST(WithUsualMuscle, DarkMuscleIsBrighterThenAndMarrowAndFatAreNot) {
  const World world = MakeWorld(0.2, 0.01);
  const double factor = kUsualMuscle / MuscleLevel(world.scan, world.strokes).value();
  EXPECT_NEAR(factor, kUsualMuscle / 0.2, 0.05);
  UsualMuscle as_usual = WithUsualMuscle(world.scan, world.strokes);
  EXPECT_NEAR(as_usual.darker, 1 - 1 / factor, 1e-12);
  const Volume usual = std::move(as_usual.scan).Taken();
  for (size_t v = 0; v < usual.values.size(); ++v) {
    const double was = world.scan.values[v] / kMarrow, is = usual.values[v] / kMarrow;
    ASSERT_GE(is, was - 1e-6) << v;
    if (was < 0.19) {
      ASSERT_NEAR(is, factor * was, 1e-4) << v;
    } else if (was > 1.01) {
      ASSERT_EQ(is, was) << v;
    }
  }
}

}  // namespace
}  // namespace kvx
