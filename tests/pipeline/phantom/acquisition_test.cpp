// Scans against the material that their voxels' samples lie in.
#include "pipeline/phantom/acquisition.h"

#include <gtest/gtest.h>

#include "tests/support/bone_in_a_ball.h"

namespace kvx::phantom {
namespace {

using testing_support::BoneInABall;
using V = Eigen::Vector3d;

const ScanGrid kScanGrid{{20, 20, 20}, V(4, 4, 4)};

struct Noiseless {
  BoneInABall body;
  CompositeMotion motion = body.Motion();
  TissueModel tissues{body.anatomy(), 7};
  MaterialMap material{body.anatomy(), tissues, 1};

  explicit Noiseless(const RigidTransform& rod) : body(rod) {}
  Volume Scan(const RigidTransform& scan_from_posed) const {
    const Scanner scanner{kScanGrid, 0, 7};
    return Acquire(scanner, 1, scan_from_posed, motion, material, tissues.FluidIntensity(), {}).intensities;
  }
  // Mean over a voxel of a scan of the body at rest.
  double LiesAt(const V& voxel, const RigidTransform& scan_from_posed) const {
    double sum = 0;
    for (int s = 0; s < 8; ++s) {
      const V corner(s & 1 ? 0.25 : -0.25, s & 2 ? 0.25 : -0.25, s & 4 ? 0.25 : -0.25);
      sum += material.Intensity(Move(scan_from_posed.Inverse(), kScanGrid.At(voxel + corner))) / 8;
    }
    return sum;
  }
};

// A coil's field is smooth: what a scan shows over what lies there is nearly alike in neighbouring voxels.
TEST(Acquire, ShowsWhatLiesAtEveryVoxel) {
  const Noiseless rest{RigidTransform{}};
  const RigidTransform lie = RotationAbout({V(5, 2, 1)}, V(1, -1, 2), 0.4);
  const Volume scan = rest.Scan(lie);
  int compared = 0;
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < 20; ++j) {
      double before = 0;
      for (int i = 0; i < 20; ++i) {
        const V voxel(i, j, k);
        const bool inside = Move(lie.Inverse(), kScanGrid.At(voxel)).norm() < BoneInABall::kRadiusMm - 3;
        const double ratio = inside ? scan(i, j, k) / rest.LiesAt(voxel, lie) : 0;
        if (ratio > 0 && before > 0) {
          EXPECT_NEAR(ratio / before, 1, 0.03) << voxel.transpose();
          ++compared;
        }
        before = ratio;
      }
    }
  }
  EXPECT_GT(compared, 1000);
}

// The rod leaves its place 10 mm behind; tissue slides over it and does not follow.
TEST(Acquire, FillsTheGapBehindABoneWithFluidButNotTheAir) {
  RigidTransform aside;
  aside.translation_mm.x() = 10;
  const Noiseless moved(aside);
  const Volume scan = moved.Scan({});
  EXPECT_NEAR(scan(8, 10, 10) / moved.tissues.FluidIntensity(), 1, 0.3);  // around -6, 2, 2
  EXPECT_EQ(scan(0, 0, 0), 0);
}

}  // namespace
}  // namespace kvx::phantom
