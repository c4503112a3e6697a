// Grids and bones on the other side.
#include "pipeline/bones/judge/mirror_image.h"

#include <gtest/gtest.h>

#include "tests/support/ellipsoid_world.h"

namespace kvx {
namespace {
using namespace testing_support;

TEST(Mirrored, EveryVoxelLiesAsFarOnTheOtherSide) {
  const Volume scan(ObliqueGrid({9, 7, 5}), 3.0f);
  const Volume mirrored = Mirrored(scan);
  EXPECT_EQ(mirrored.values, scan.values);
  const double middle = scan.grid.ToMm(4, 3, 2).lps.x();
  for (const Eigen::Vector3i& at : {Eigen::Vector3i(0, 0, 0), Eigen::Vector3i(8, 1, 4)}) {
    const Eigen::Vector3d before = scan.grid.ToMm(at.x(), at.y(), at.z()).lps;
    const Eigen::Vector3d after = mirrored.grid.ToMm(at.x(), at.y(), at.z()).lps;
    EXPECT_LT((after - Eigen::Vector3d(2 * middle - before.x(), before.y(), before.z())).norm(), 1e-9);
    const Eigen::Vector3d there = mirrored.grid.ToVox(PointMm{after}).ijk;
    EXPECT_LT((there - at.cast<double>()).norm(), 1e-9) << "and is found there";
  }
}

// A bone that no plane divides alike, by the texture of its marrow.
TEST(MirrorNats, TellABoneFromItsMirrorImage) {
  const EllipsoidWorld world(kOneBone, Box({60, 44, 40}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity()));
  const PoseVector truth{Exp((Twist() << 0.1, -0.2, 0.15, 2.0, 1.0, -2.0).finished())};
  const Volume scan = Painted(Box({66, 60, 50}, {1.0, 1.0, 1.0}, kOblique), world.ellipsoids, truth);
  const SoughtBones sought = world.SoughtIn(scan);
  BoneFits fits(1);
  fits[0].scan_from_template = truth[0];
  EXPECT_LT(MirrorNats(sought, scan, fits), -20);
  // There the bone's reflection across the plane of normal n = R^T x lies, turned as before: M R (I - 2 n
  // n^T) = R.
  const Volume mirrored = Mirrored(scan);
  const PointVox middle{0.5 * (scan.grid.size.array() - 1).cast<double>().matrix()};
  const double centre_x = (truth[0] * world.bones->bones[0].centroid).lps.x();
  fits[0].scan_from_template.translation_mm.x() += 2 * (scan.grid.ToMm(middle).lps.x() - centre_x);
  EXPECT_GT(MirrorNats(sought, mirrored, fits), 20);
  fits[0].doubt = Doubt::kBone;
  EXPECT_EQ(MirrorNats(sought, mirrored, fits), 0) << "nothing is known of a bone in doubt";
}

}  // namespace
}  // namespace kvx
