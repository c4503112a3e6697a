// A bright body in air. As dark, and no air: a hole in it, and a thin layer that reaches the border of the
// view.
#include "pipeline/segmentation/mr/levels/air_around.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace kvx {
namespace {

// What `show(p)` says at every voxel, with noise as magnitude images have it.
template <class Show>
Volume Shown(const Show& show, double noise) {
  Grid grid;
  grid.size = {40, 24, 24};
  Volume volume(grid);
  std::mt19937 random(7);
  std::normal_distribution<double> deviate(0, noise);
  for (size_t v = 0; v < volume.values.size(); ++v)
    volume.values[v] = float(std::hypot(show(grid.Ijk(v)) + deviate(random), deviate(random)));
  return volume;
}

// Of a voxel, in voxels of 1 mm; negative in air.
int Depth(const Eigen::Vector3i& p) { return std::min(p.x() - 10, 30 - p.x()); }
bool InHole(const Eigen::Vector3i& p) { return (p - Eigen::Vector3i(15, 12, 12)).cwiseAbs().maxCoeff() <= 2; }
bool InLayer(const Eigen::Vector3i& p) { return std::abs(p.x() - 23) <= 1; }
double Body(const Eigen::Vector3i& p) { return Depth(p) < 0 || InHole(p) || InLayer(p) ? 0.0 : 200.0; }

bool Empty(const LabelMap& air) {
  return std::ranges::all_of(air.values, [](uint16_t value) { return value == 0; });
}

TEST(AirAround, IsWideAndAtTheBorder) {
  for (const double noise : {0.01, 5.0}) {
    const Volume scan = Shown(Body, noise);
    const LabelMap air = AirAround(scan, 200);
    size_t found = 0, all = 0;
    for (size_t v = 0; v < air.values.size(); ++v) {
      const Eigen::Vector3i p = scan.grid.Ijk(v);
      if (Depth(p) >= 0) {
        EXPECT_EQ(air.values[v], 0) << p.transpose();
      }
      if (Depth(p) < -1) all += 1, found += air.values[v];
    }
    EXPECT_EQ(found, all) << noise;
  }
}

TEST(AirAround, IsNothingWhereAScanShowsNoAir) {
  EXPECT_TRUE(Empty(AirAround(Shown([](const Eigen::Vector3i&) { return 200.0; }, 5), 200)));
}

TEST(AirAround, IsNothingWhereMarrowIsAsDark) { EXPECT_TRUE(Empty(AirAround(Shown(Body, 5), 30))); }

}  // namespace
}  // namespace kvx
