// Marrow with noise of a known size, and strokes in it.
#include "pipeline/segmentation/mr/levels/noisy_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "pipeline/segmentation/mr/levels/stroke_levels.h"

namespace kvx {
namespace {

struct World {
  Volume scan;
  LabelMap strokes;
};

// `noise`: in parts of the marrow.
World MakeWorld(double noise, int seed = 3) {
  Grid grid;
  grid.size = {40, 30, 20};
  World world{Volume(grid), LabelMap(grid)};
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, noise);
  for (size_t v = 0; v < world.scan.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v);
    world.scan.values[v] = float(150 * (1 + normal(random)));
    if (p.y() % 5 == 2 && p.z() % 5 == 2 && p.x() < 20) world.strokes.values[v] = 4;
    if (p.x() > 30) world.strokes.values[v] = 255;
  }
  return world;
}

Volume Calm(const World& world) {
  return CalmScan(world.scan, world.strokes, MarrowLevels(world.scan, world.strokes)).Taken();
}

double DeviationOf(const Volume& scan) {
  double sum = 0, squares = 0;
  for (const float v : scan.values) sum += v, squares += double(v) * v;
  const double count = double(scan.values.size());
  return std::sqrt(squares / count - sum * sum / (count * count));
}

TEST(CalmScan, AScanOfLittleNoiseStaysAsItIs) {
  const World world = MakeWorld(0.05);
  EXPECT_EQ(Calm(world).values, world.scan.values);
}

// Of 0.08, whatever the numbers; of 0.14, too, though what is darker than sure marrow is not seen.
TEST(CalmScan, WhatIsMuchIsToldApart) {
  for (int seed = 1; seed <= 8; ++seed) {
    const World little = MakeWorld(0.08, seed), much = MakeWorld(0.14, seed);
    EXPECT_EQ(Calm(little).values, little.scan.values) << seed;
    EXPECT_NE(Calm(much).values, much.scan.values) << seed;
  }
}

// By a Gaussian of half a voxel, cut at three deviations, so at the next voxel: (1, e^-2) along each axis.
TEST(CalmScan, MuchNoiseIsSmoothed) {
  const double along_an_axis = (1 + 2 * std::exp(-4)) / std::pow(1 + 2 * std::exp(-2), 2);
  const World world = MakeWorld(0.14);
  EXPECT_NEAR(DeviationOf(Calm(world)) / DeviationOf(world.scan), std::pow(along_an_axis, 1.5),
              0.02);  // less at the sides
}

// Along every axis 0.76, 0.88, 1, 1.12, 1.24 again and again. Marrow's level is near the last, so
// 1, 1.12, 1.24 are sure marrow: on one line, but 0.1 of the level apart.
TEST(CalmScan, SlopesAreNoNoise) {
  World world = MakeWorld(0);
  for (size_t v = 0; v < world.scan.values.size(); ++v)
    world.scan.values[v] *= float(1 + 0.12 * (world.scan.grid.Ijk(v).sum() % 5 - 2));
  for (size_t v = 0; v < world.scan.values.size(); ++v) {
    if (world.scan.grid.Ijk(v).x() < 20) world.strokes.values[v] = 4;
  }
  EXPECT_EQ(Calm(world).values, world.scan.values);
}

TEST(CalmScan, WithoutStrokesNothingIsKnownOfNoise) {
  World world = MakeWorld(0.12);
  world.strokes = LabelMap(world.scan.grid);
  EXPECT_EQ(Calm(world).values, world.scan.values);
}

}  // namespace
}  // namespace kvx
