// Weights where they can be written down: bars, separate fingers, symmetric bodies.
#include "pipeline/skinning/compute_weights.h"

#include <gtest/gtest.h>

#include "core/errors.h"
#include "core/voxels/neighbours.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

struct World {
  Mask body;
  BoneSet bones;

  World(const Grid& grid, int bone_count) : body(grid) {
    bones.labels = LabelMap(grid);
    for (int b = 0; b < bone_count; ++b) bones.bones.push_back({.label = 10 + b, .name = std::to_string(b)});
  }
  void Body(const Eigen::Vector3i& from, const Eigen::Vector3i& to) {
    ForBox(from, to, [&](int i, int j, int k) { body(i, j, k) = 1; });
  }
  void BoneBox(int bone, const Eigen::Vector3i& from, const Eigen::Vector3i& to) {
    ForBox(from, to, [&](int i, int j, int k) { bones.labels(i, j, k) = uint16_t(10 + bone); });
  }
  static void ForBox(const Eigen::Vector3i& from, const Eigen::Vector3i& to, auto&& visit) {
    for (int k = from.z(); k <= to.z(); ++k) {
      for (int j = from.y(); j <= to.y(); ++j) {
        for (int i = from.x(); i <= to.x(); ++i) visit(i, j, k);
      }
    }
  }
  WeightMap Weights(double tolerance = 1e-6) const {
    StageContext context{SharedBackend(), {}};
    const Artifact<BoneSet> bone_set{{}, std::make_shared<BoneSet>(bones)};
    const Artifact<Mask> mask{{}, std::make_shared<Mask>(body)};
    return ComputeWeights::Run({bone_set, mask}, {tolerance}, context);
  }
};

double WeightOf(const VoxelWeights& voxel, int bone) {
  double sum = 0;
  for (int s = 0; s < kBonesPerVoxel; ++s) sum += voxel.bones[s] == bone ? voxel.weights[s] : 0.0f;
  return sum;
}

// From surface to surface, half a voxel from the bones' last centres.
TEST(ComputeWeights, ABarBetweenTwoBonesIsLinear) {
  for (int axis = 0; axis < 3; ++axis) {
    World world(ObliqueGrid({13, 13, 13}), 2);
    Eigen::Vector3i from(4, 4, 4), to(6, 6, 6);
    from[axis] = 1, to[axis] = 11;
    world.Body(from, to);
    Eigen::Vector3i left = to, right = from;
    left[axis] = 1, right[axis] = 11;
    world.BoneBox(0, from, left);
    world.BoneBox(1, right, to);
    const WeightMap weights = world.Weights();
    for (int p = 1; p <= 11; ++p) {
      Eigen::Vector3i at(5, 5, 5);
      at[axis] = p;
      const double linear = std::clamp((p - 1.5) / 9, 0.0, 1.0);
      EXPECT_NEAR(WeightOf(weights(at.x(), at.y(), at.z()), 1), linear, 1e-3) << "axis " << axis;
    }
  }
}

Grid Cubes(const Eigen::Vector3i& size) {
  Grid grid = ObliqueGrid(size);
  grid.spacing_mm.setOnes();
  return grid;
}

// A passage one voxel wide that winds through a plane, with a bone at either end: its voxels in order.
std::vector<Eigen::Vector3i> WindAlong(int width, World& world) {
  std::vector<Eigen::Vector3i> path;
  for (int row = 1; row <= width; row += 2) {
    const bool back = row / 2 % 2 == 1;
    for (int i = 1; i <= width; ++i) path.push_back({back ? width + 1 - i : i, row, 1});
    if (row + 2 <= width) path.push_back({back ? 1 : width, row + 1, 1});
  }
  for (const Eigen::Vector3i& p : path) world.Body(p, p);
  world.BoneBox(0, path.front(), path.front());
  world.BoneBox(1, path.back(), path.back());
  return path;
}

// Coarse levels take neighbouring runs of such a passage for one, so cycles help little and many are needed.
TEST(ComputeWeights, ALongWindingPassageIsLinear) {
  for (const int width : {15, 23}) {  // of one level and of two
    World world(Cubes({width + 2, width + 2, 3}), 2);
    const std::vector<Eigen::Vector3i> path = WindAlong(width, world);
    const WeightMap weights = world.Weights(1e-4);
    double farthest = 0;
    for (size_t p = 1; p + 1 < path.size(); ++p) {
      const double linear = (double(p) - 0.5) / double(path.size() - 2);
      const VoxelWeights& here = weights(path[p].x(), path[p].y(), path[p].z());
      farthest = std::max(farthest, std::abs(WeightOf(here, 1) - linear));
    }
    EXPECT_LT(farthest, 2e-3) << "width " << width;
  }
}

TEST(ComputeWeights, ABodyThatWindsTooMuchIsRefused) {
  World world(Cubes({129, 129, 3}), 2);
  WindAlong(127, world);
  EXPECT_THROW(world.Weights(1e-4), InputError);
}

// What is harmonic is the mean of what lies around it, bones counting twice: they begin half a voxel nearer.
// Two plates, one and two voxels apart, in a large body.
TEST(ComputeWeights, NarrowGapsBetweenBonesAreHarmonicAndSoAreThickSlices) {
  for (const double thickness : {1.0, 4.0}) {
    Grid grid = ObliqueGrid({112, 112, 56});
    grid.spacing_mm = {1, 1, thickness};
    World world(grid, 2);
    world.Body({1, 1, 1}, {110, 110, 54});
    world.BoneBox(0, {8, 8, 16}, {103, 103, 18});
    world.BoneBox(1, {8, 8, 20}, {103, 80, 22});
    world.BoneBox(1, {8, 81, 21}, {103, 103, 23});
    const WeightMap weights = world.Weights(1e-5);
    double farthest = 0;
    for (int k = 2; k < 54; ++k) {
      for (int j = 2; j < 110; ++j) {
        for (int i = 2; i < 110; ++i) {
          if (world.bones.labels(i, j, k) != 0) continue;
          double sum = 0, count = 0;
          for (int side = 0; side < 6; ++side) {
            const Eigen::Vector3i p = Eigen::Vector3i(i, j, k) + StepToSide(side);
            const double share = (side / 2 == 2 ? 1 / (thickness * thickness) : 1) *
                                 (world.bones.labels(p.x(), p.y(), p.z()) != 0 ? 2 : 1);
            sum += share * WeightOf(weights(p.x(), p.y(), p.z()), 1), count += share;
          }
          farthest = std::max(farthest, std::abs(WeightOf(weights(i, j, k), 1) - sum / count));
        }
      }
    }
    EXPECT_LT(farthest, 1e-4) << "slices of " << thickness << " mm";
  }
}

TEST(ComputeWeights, ArePartitionsOfUnityAndRigidInBones) {
  World world(ObliqueGrid({20, 18, 16}), 11);  // more bones than one solve holds, and than a voxel keeps
  world.Body({1, 1, 1}, {18, 16, 14});
  for (int b = 0; b < 11; ++b) world.BoneBox(b, {2 + b, 2 + b, 3 + b % 8}, {3 + b, 4 + b, 4 + b % 8});
  const WeightMap weights = world.Weights(1e-4);
  for (size_t v = 0; v < weights.values.size(); ++v) {
    const VoxelWeights& voxel = weights.values[v];
    double sum = 0;
    for (int s = 0; s < kBonesPerVoxel; ++s) {
      sum += voxel.weights[s];
      ASSERT_GE(voxel.weights[s], 0.0f);
      if (s > 0) {
        ASSERT_LE(voxel.weights[s], voxel.weights[s - 1]);
      }
    }
    ASSERT_NEAR(sum, 1.0, 1e-5);
    const int label = world.bones.labels.values[v];
    if (label > 0) {
      ASSERT_EQ(voxel.weights[0], 1.0f);
      ASSERT_EQ(voxel.bones[0], label - 10);
    }
  }
}

// Two fingers side by side, one voxel of air between them: not the least weight crosses, however near the
// other bone.
TEST(ComputeWeights, NothingCrossesOneVoxelOfAir) {
  World world(ObliqueGrid({11, 24, 9}), 2);
  world.Body({1, 2, 2}, {4, 21, 6});
  world.Body({6, 2, 2}, {9, 21, 6});
  world.BoneBox(0, {2, 3, 3}, {3, 5, 5});
  world.BoneBox(1, {7, 3, 3}, {8, 20, 5});
  const WeightMap weights = world.Weights();
  for (size_t v = 0; v < weights.values.size(); ++v) {
    if (world.body.values[v]) {
      ASSERT_EQ(WeightOf(weights.values[v], weights.grid.Ijk(v).x() < 5 ? 0 : 1), 1.0);
    }
  }
}

// A limb along z on a rod, with a plate on its skin, of which a scan shows the last planes from `first` on.
WeightMap OfALimbFrom(int first) {
  World world(ObliqueGrid({23, 23, 100 - first}), 2);
  world.Body({3, 3, 0}, {19, 19, 99 - first});
  world.BoneBox(0, {10, 10, 0}, {12, 12, 99 - first});
  world.BoneBox(1, {4, 8, 60 - first}, {5, 14, 66 - first});
  return world.Weights();
}

// Where a scan ends a limb does not. Without a way on, the plate's weights come to twice what they are.
TEST(ComputeWeights, AreThoseOfALimbThatGoesOnBeyondTheScan) {
  constexpr int kFirst = 50;
  const WeightMap whole = OfALimbFrom(0), cut = OfALimbFrom(kFirst);
  const double there = WeightOf(whole(4, 11, kFirst), 1);
  ASSERT_GT(there, 0.05);
  EXPECT_NEAR(WeightOf(cut(4, 11, 0), 1), there, 0.1 * there);
}

TEST(ComputeWeights, AMirroredBodyHasMirroredWeights) {
  World world(ObliqueGrid({16, 9, 8}), 2);
  world.Body({1, 1, 1}, {14, 7, 6});
  world.BoneBox(0, {2, 2, 2}, {3, 6, 4});
  world.BoneBox(1, {12, 2, 2}, {13, 6, 4});
  const WeightMap weights = world.Weights();
  World::ForBox({0, 0, 0}, {15, 8, 7}, [&](int i, int j, int k) {
    ASSERT_NEAR(WeightOf(weights(i, j, k), 0), WeightOf(weights(15 - i, j, k), 1), 1e-3);
  });
}

TEST(ComputeWeights, APieceWithoutBoneFollowsTheNearestBone) {
  World world(ObliqueGrid({20, 8, 8}), 2);
  world.Body({1, 2, 2}, {7, 5, 5});
  world.Body({10, 2, 2}, {17, 5, 5});
  world.BoneBox(0, {1, 2, 2}, {2, 5, 5});
  world.BoneBox(1, {6, 2, 2}, {7, 5, 5});
  const WeightMap weights = world.Weights();
  World::ForBox({10, 2, 2}, {17, 5, 5},
                [&](int i, int j, int k) { ASSERT_EQ(WeightOf(weights(i, j, k), 1), 1.0); });
}

TEST(ComputeWeights, OutsideTheBodyAreThoseOfTheNearestBodyVoxel) {
  World world(ObliqueGrid({13, 9, 9}), 2);
  world.Body({1, 4, 4}, {11, 4, 4});
  world.BoneBox(0, {1, 4, 4}, {1, 4, 4});
  world.BoneBox(1, {11, 4, 4}, {11, 4, 4});
  const WeightMap weights = world.Weights();
  for (int i = 1; i <= 11; ++i) EXPECT_EQ(WeightOf(weights(i, 8, 4), 1), WeightOf(weights(i, 4, 4), 1));
  EXPECT_EQ(WeightOf(weights(12, 0, 0), 1), 1.0);
}

TEST(ComputeWeights, ALabelMapWithoutBonesIsRefused) {
  World world(ObliqueGrid(), 1);
  world.Body({1, 1, 1}, {5, 5, 5});
  EXPECT_THROW(world.Weights(), InputError);
}

}  // namespace
}  // namespace kvx
