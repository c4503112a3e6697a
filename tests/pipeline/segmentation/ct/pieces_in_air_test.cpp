// Rods along z and plates, each edge blurred over 1.2 mm.
#include "pipeline/segmentation/ct/pieces_in_air.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/voxels/components.h"
#include "pipeline/segmentation/ct/ct_outside.h"
#include "pipeline/segmentation/ct/threshold_bones.h"
#include "tests/support/plain_grid.h"

namespace kvx {
namespace {

constexpr double kLevelHu = 300;

class Scene {
 public:
  Scene() : scan(testing_support::Cubes({60, 60, 140}, 0.8), -1000.0f) {}

  // `inside_mm`: of a voxel's place in mm, how far inside the thing it lies.
  template <class Inside>
  Scene& With(double hu, const Inside& inside_mm) {
    for (size_t v = 0; v < scan.values.size(); ++v) {
      const double share =
          std::clamp(0.5 + inside_mm(Eigen::Vector3d(scan.grid.Ijk(v).cast<double>() * 0.8)) / 1.2, 0.0, 1.0);
      scan.values[v] += float(share * (hu - double(scan.values[v])));
    }
    return *this;
  }
  Scene& WithRod(double hu, double radius_mm, double x_mm = 24) {
    return With(
        hu, [=](const Eigen::Vector3d& mm) { return radius_mm - std::hypot(mm.x() - x_mm, mm.y() - 24); });
  }
  Scene& WithCouch() {
    return With(600, [](const Eigen::Vector3d& mm) { return 1.3 - std::abs(mm.y() - 40); });
  }

  Volume scan;
};

struct Dropped {
  DenseInAir in_air;
  size_t pieces_left;
};

Dropped DroppedFrom(const Volume& scan) {
  Mask dense(scan.grid);
  for (size_t v = 0; v < dense.values.size(); ++v) dense.values[v] = scan.values[v] > kLevelHu;
  const DenseInAir in_air = DropPiecesInAir(scan, dense);
  return {in_air, LabelComponents(dense).voxels.size()};
}

TEST(DropPiecesInAir, ACouchGoesAndAFingerBoneStays) {
  const Dropped with_couch = DroppedFrom(Scene().WithCouch().WithRod(40, 7).WithRod(800, 3.5).scan);
  EXPECT_EQ(with_couch.in_air.dropped, 1);
  EXPECT_FALSE(with_couch.in_air.all);
  EXPECT_EQ(with_couch.pieces_left, 1u);
}

// A limb as thick as that lies on all of its middle.
TEST(DropPiecesInAir, ACouchThatBearsALimbGoes) {
  const Dropped bearing = DroppedFrom(Scene().WithRod(40, 15).WithCouch().WithRod(800, 5).scan);
  EXPECT_EQ(bearing.in_air.dropped, 1);
  EXPECT_EQ(bearing.pieces_left, 1u);
}

// Lung behind a rib: 1 mm of tissue on that side, much on the other.
TEST(DropPiecesInAir, ARibBesideTheLungStays) {
  Scene chest;
  chest.With(40, [](const Eigen::Vector3d& mm) { return mm.y() - 20; });
  chest.With(800, [](const Eigen::Vector3d& mm) { return 2 - std::abs(mm.y() - 23); });
  chest.WithRod(800, 3, 5).With(600, [](const Eigen::Vector3d& mm) { return 1.3 - std::abs(mm.y() - 8); });
  const Dropped dropped = DroppedFrom(chest.scan);
  EXPECT_EQ(dropped.in_air.dropped, 1) << "what lies in the lung's air by itself";
  EXPECT_EQ(dropped.pieces_left, 1u);
}

TEST(DropPiecesInAir, BonesWithoutFleshStay) {
  const Dropped dropped = DroppedFrom(Scene().WithRod(800, 5, 14).WithRod(800, 5, 34).scan);
  EXPECT_EQ(dropped.in_air.dropped, 0);
  EXPECT_TRUE(dropped.in_air.all);
  EXPECT_EQ(dropped.pieces_left, 2u);
}

// A cast that the view cuts at both ends encloses its limb as cortex encloses marrow.
TEST(ThresholdBones, ACastIsNoBoneAroundTheLimb) {
  const Volume scan =
      Scene().WithRod(600, 23).WithRod(-950, 19).WithRod(40, 16).WithRod(800, 5, 16).WithRod(800, 4, 31).scan;
  const DenseBones bones = ThresholdBones(scan, {kLevelHu, kLevelHu});
  EXPECT_EQ(bones.in_air.dropped, 1);
  EXPECT_EQ(*std::ranges::max_element(bones.labels.values), 2);
  EXPECT_EQ(bones.labels(20, 30, 20), 1);
  EXPECT_EQ(bones.labels(39, 30, 20), 2);
  EXPECT_EQ(bones.labels(30, 42, 20), 0) << "tissue";
}

TEST(OutsideOfBones, ReachesTheTissueInACast) {
  const Volume scan = Scene().WithRod(600, 23).WithRod(-950, 19).WithRod(40, 16).WithRod(800, 4).scan;
  const Mask outside = OutsideOfBones(scan);
  EXPECT_TRUE(outside(30 + 17, 30, 70)) << "13.6 mm beside the bone's middle";
  EXPECT_FALSE(outside(30 + 8, 30, 70)) << "6.4 mm beside it";
}

}  // namespace
}  // namespace kvx
