// Pieces of random masks against what spreading numbers step by step gives.
#include "core/voxels/components.h"

#include <gtest/gtest.h>

#include <algorithm>
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

// Some of its voxels are set.
Mask Speckled(const Eigen::Vector3i& size, unsigned seed) {
  Grid grid;
  grid.size = size;
  Mask mask(grid);
  std::mt19937 random(seed);
  for (uint8_t& m : mask.values) m = random() % 10 < 4 + seed % 4;
  return mask;
}

TEST(PiecesAtBorder, AreThoseWithAVoxelInAFaceOfTheGrid) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    const Mask mask = Speckled({9 - int(seed % 2), 8, seed % 4 ? 6 : 1}, seed);
    const Grid& grid = mask.grid;
    const Components pieces = LabelComponents(mask);
    std::vector<uint8_t> touches(pieces.voxels.size(), 0);
    for (size_t v = 0; v < mask.values.size(); ++v) {
      const Eigen::Vector3i p = grid.Ijk(v);
      for (int axis = 0; axis < 3; ++axis) {
        const bool in_face = grid.size[axis] > 1 && (p[axis] == 0 || p[axis] + 1 == grid.size[axis]);
        if (mask.values[v] && in_face) touches[size_t(pieces.piece.values[v])] = 1;
      }
    }
    EXPECT_EQ(PiecesAtBorder(mask).values, MaskOf(pieces, touches).values) << "seed " << seed;
  }
}

TEST(KeepLargePieces, KeepsThoseOfTheShareOfTheLargest) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    const Mask mask = Speckled({9, 8, 7}, 2 * seed);
    const Components pieces = LabelComponents(mask);
    const size_t largest = *std::ranges::max_element(pieces.voxels);
    std::vector<uint8_t> large;
    for (const size_t voxels : pieces.voxels) large.push_back(4 * voxels >= largest);
    EXPECT_EQ(KeepLargePieces(mask, 0.25).values, MaskOf(pieces, large).values) << "seed " << seed;
  }
  const Mask nothing(Speckled({3, 4, 1}, 1).grid);
  EXPECT_EQ(KeepLargePieces(nothing, 0.5).values, nothing.values);
}

TEST(LabelComponents, AreThePiecesInTheOrderOfTheirFirstVoxels) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    const Mask mask = Speckled({9, 8 - int(seed % 3), 1 + int(seed % 7)}, seed);
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
