// A finger as it lies in air: a round bone a few voxels thick, under thin skin on one side.
#include "pipeline/segmentation/mr/mr_bones.h"

#include <gtest/gtest.h>

#include <random>

namespace kvx {
namespace {

constexpr double kSpacingMm = 2, kRadiusMm = 5, kCortexMm = 1;
const Eigen::Vector3d kCentreMm(40, 30.7, 30.3);

// In the bone, a rod with round ends.
double Depth(const Eigen::Vector3d& mm) {
  Eigen::Vector3d off = mm - kCentreMm;
  off.x() = std::max(0.0, std::abs(off.x()) - 10);
  return kRadiusMm - off.norm();
}

// Box of a voxel, and half as much again of the scanner's.
double Grey(const Eigen::Vector3d& mm, double skin_mm) {
  constexpr int kPlaces = 4;
  double sum = 0;
  for (int n = 0; n < kPlaces * kPlaces * kPlaces; ++n) {
    const Eigen::Array3d place(n % kPlaces, n / kPlaces % kPlaces, n / kPlaces / kPlaces);
    const Eigen::Vector3d at = mm + (1.5 * kSpacingMm * ((place + 0.5) / kPlaces - 0.5)).matrix();
    const double depth = Depth(at), above = at.z() - (kCentreMm.z() + kRadiusMm);
    sum += depth > kCortexMm ? 170 : depth > 0 ? 17 : above < skin_mm ? 95 : 2;
  }
  return sum / (kPlaces * kPlaces * kPlaces);
}

struct World {
  Volume scan;
  LabelMap strokes;
  Mask truth;
};

World MakeWorld(double skin_mm) {
  Grid grid;
  grid.size = {40, 30, 30}, grid.spacing_mm = Eigen::Vector3d::Constant(kSpacingMm);
  World world{Volume(grid), LabelMap(grid), Mask(grid)};
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 4);
  for (size_t v = 0; v < world.scan.values.size(); ++v) {
    const Eigen::Vector3d mm = grid.Ijk(v).cast<double>() * kSpacingMm;
    world.scan.values[v] = float(std::abs(Grey(mm, skin_mm) + noise(random)));
    world.truth.values[v] = Depth(mm) > 0;
  }
  for (int n = 14; n < 27; ++n) {
    for (const auto& [j, k] : {std::pair(15, 15), std::pair(14, 14), std::pair(16, 16), std::pair(15, 14)})
      world.strokes(n, j, k) = 1;
    for (const auto& [j, k] : {std::pair(15, 10), std::pair(11, 15), std::pair(20, 14), std::pair(18, 11)})
      world.strokes(n, j, k) = 255;
  }
  for (int n = 9; n < 21; ++n) world.strokes(8, n, 15) = world.strokes(32, n, 15) = 255;
  return world;
}

// How much of the bone's upper half was found, by volume.
double UpperShare(const World& world, const FoundBone& bone) {
  double found = 0, all = 0;
  ForEachVoxel(bone.box, world.scan.grid, [&](const Eigen::Vector3i& p, size_t part, size_t whole) {
    if ((p.z() + bone.box.low.z()) * kSpacingMm < kCentreMm.z()) return;
    found += bone.mask.values[part], all += world.truth.values[whole];
  });
  return found / all;
}

TEST(MrBones, CortexUnderThinSkinIsNotLeftOut) {
  for (const double skin_mm : {1.0, 1.5, 2.5}) {
    const World world = MakeWorld(skin_mm);
    const MrBones found = FindMrBones(world.scan, world.strokes, StrokeBoxes(world.strokes),
                                      LabelMap(world.scan.grid), Progress());
    EXPECT_NEAR(UpperShare(world, found.bones.at(0)), 1, 0.08) << skin_mm;
  }
}

}  // namespace
}  // namespace kvx
