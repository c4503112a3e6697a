// Pieces of random masks against what spreading numbers step by step gives.
#include "core/components.h"

#include <gtest/gtest.h>

#include <random>

namespace kvx {
namespace {

// Numbers spread to neighbours until nothing changes: the lowest voxel of a piece gives its name.
Image<int64_t> NamedBySpreading(const Mask& mask) {
  const Grid& grid = mask.grid;
  Image<int64_t> name(grid, -1);
  for (size_t v = 0; v < mask.values.size(); ++v) name.values[v] = mask.values[v] ? int64_t(v) : -1;
  for (bool changed = true; changed;) {
    changed = false;
    for (size_t v = 0; v < mask.values.size(); ++v) {
      for (int n = 0; n < 6; ++n) {
        Eigen::Vector3i p = grid.Ijk(v);
        p[n / 2] += n % 2 ? 1 : -1;
        if (!mask.values[v] || !grid.Contains(p)) continue;
        const int64_t there = name(p.x(), p.y(), p.z());
        if (there >= 0 && there < name.values[v]) name.values[v] = there, changed = true;
      }
    }
  }
  return name;
}

TEST(LabelComponents, AreThePiecesInTheOrderOfTheirFirstVoxels) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    Grid grid;
    grid.size = {9, 8 - int(seed % 3), 1 + int(seed % 7)};
    Mask mask(grid);
    std::mt19937 random(seed);
    for (uint8_t& m : mask.values) m = random() % 10 < 4 + seed % 4;
    const Components pieces = LabelComponents(mask);
    const Image<int64_t> name = NamedBySpreading(mask);
    std::vector<size_t> voxels;
    for (size_t v = 0; v < mask.values.size(); ++v) {
      if (name.values[v] == int64_t(v)) voxels.push_back(0);
      const int32_t piece = pieces.piece.values[v];
      ASSERT_EQ(piece >= 0, mask.values[v] != 0) << "seed " << seed;
      if (piece < 0) continue;
      if (name.values[v] == int64_t(v)) {
        EXPECT_EQ(piece, int32_t(voxels.size()) - 1) << "seed " << seed;
      }
      EXPECT_EQ(piece, pieces.piece.values[size_t(name.values[v])]) << "seed " << seed;
      ++voxels[size_t(piece)];
    }
    EXPECT_EQ(pieces.voxels, voxels) << "seed " << seed;
  }
}

}  // namespace
}  // namespace kvx
