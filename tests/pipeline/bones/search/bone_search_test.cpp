// What a search tries beside what it always tries.
#include "pipeline/bones/search/bone_search.h"

#include <gtest/gtest.h>

#include "tests/support/ellipsoid_world.h"

namespace kvx {
namespace {
using namespace testing_support;

// Roots are looked for up to 75 degrees from how they lie in the template.
TEST(BoneSearch, AlsoTriesAPlaceBeyondItsOwn) {
  const EllipsoidWorld world(kOneBone, Box({60, 52, 46}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity()));
  const RigidTransform truth =
      RotationAbout(PointMm{kOneBone[0].centre_mm}, Eigen::Vector3d(1, 3, 2).normalized(), RadFromDeg(130));
  const Volume scan =
      Painted(Box({56, 56, 56}, {1.1, 1.1, 1.1}, Eigen::Matrix3d::Identity()), kOneBone, {truth});
  const SoughtBones sought = world.SoughtIn(scan);
  const BoneSearch search(sought, scan, SharedBackend(), {});
  EXPECT_GT(AngleDeg(search.Find(0, PartialPose(1)).front().pose, truth), 20);
  const RigidTransform near = truth * RotationAbout(PointMm{kOneBone[0].centre_mm}, {0, 0, 1}, RadFromDeg(8));
  const Candidate found = search.TryingAlso({{0, near}}).Find(0, PartialPose(1)).front();
  EXPECT_LT(AngleDeg(search.Finest(0, found).pose, truth), 1);
}

// Where it tries millions of poses, whoever stops it would wait for all of them.
TEST(BoneSearch, StopsBetweenThePosesOfABone) {
  const EllipsoidWorld world(kOneBone, Box({60, 52, 46}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity()));
  const Volume scan = Painted(Box({56, 56, 56}, {4, 4, 4}, Eigen::Matrix3d::Identity()), kOneBone, {{}});
  const SoughtBones sought = world.SoughtIn(scan);
  int asked = 0;
  const Progress stopped({}, [&] { return ++asked > 2; });
  const BoneSearch search(sought, scan, SharedBackend(), {}, stopped);
  EXPECT_THROW(search.Find(0, PartialPose(1)), Cancelled);
  EXPECT_EQ(asked, 3) << "at most two batches of poses";
}

}  // namespace
}  // namespace kvx
