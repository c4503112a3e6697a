// What counts as inner tissue and as body, beside plain loops over the voxels.
#include "pipeline/posing/brick_body.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

struct Beside {
  int with_tissue = 0, in_grid = 0, axes_between = 0;
};

Beside BesideOf(const Mask& mask, const Eigen::Vector3i& at) {
  Beside out;
  for (int a = 0; a < 3; ++a) {
    int along = 0;
    for (const int step : {-1, 1}) {
      const Eigen::Vector3i p = at + step * Eigen::Vector3i::Unit(a);
      if (!mask.grid.Contains(p)) continue;
      ++out.in_grid, along += mask(p.x(), p.y(), p.z());
    }
    out.with_tissue += along, out.axes_between += along == 2;
  }
  return out;
}

template <class Decide>
Mask Decided(const Mask& mask, const Decide& decide) {
  Mask out(mask.grid);
  for (size_t v = 0; v < out.values.size(); ++v)
    out.values[v] = decide(mask.values[v] != 0, BesideOf(mask, mask.grid.Ijk(v)));
  return out;
}

Mask InnerOf(const Mask& body) {
  Mask inner =
      Decided(body, [](bool tissue, const Beside& b) { return tissue && b.with_tissue == b.in_grid; });
  while (true) {
    const Mask filled =
        Decided(inner, [](bool tissue, const Beside& b) { return tissue || b.axes_between > 1; });
    if (filled.values == inner.values) return inner;
    inner = filled;
  }
}

bool Bit(const BrickedBody& b, int brick, int kind, const Eigen::Vector3i& in_brick) {
  const int n = in_brick.x() + 5 * in_brick.y() + 25 * in_brick.z();
  return b.tissue[size_t(brick)][size_t(4 * kind + (n >> 5))] >> (n & 31) & 1;
}

TEST(BrickBody, TellsInnerTissueAndLoneVoxelsAsPlainLoopsDo) {
  std::mt19937 random(7);
  for (const Eigen::Vector3i& size : {Eigen::Vector3i(37, 9, 11), Eigen::Vector3i(1, 6, 5)}) {
    Mask tissue(ObliqueGrid(size));
    for (uint8_t& voxel : tissue.values) voxel = random() % 8 != 0;
    const Mask inner = InnerOf(tissue);
    Mask joined = tissue;
    for (size_t v = 0; v < joined.values.size(); ++v) joined.values[v] |= inner.values[v];
    const Mask body = Decided(joined, [](bool set, const Beside& b) { return set && b.with_tissue > 0; });
    BoneSet bones;
    bones.labels = LabelMap(tissue.grid);
    const BrickedBody b = BrickBody(tissue, bones, WeightMap(tissue.grid), 0, {});
    ASSERT_GT(b.cell_bricks, 0);
    for (int brick = 0; brick < b.cell_bricks; ++brick) {
      for (int n = 0; n < 64; ++n) {
        const Eigen::Vector3i in_brick(n % 4, n / 4 % 4, n / 16), at = b.FirstNode(brick) + in_brick;
        if (!tissue.grid.Contains(at)) continue;
        EXPECT_EQ(Bit(b, brick, 0, in_brick), body(at.x(), at.y(), at.z()) != 0) << at.transpose();
        EXPECT_EQ(Bit(b, brick, 2, in_brick), inner(at.x(), at.y(), at.z()) != 0) << at.transpose();
      }
    }
  }
}

}  // namespace
}  // namespace kvx
