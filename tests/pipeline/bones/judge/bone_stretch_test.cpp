// Stretches that were planted by voxels of another size.
#include "pipeline/bones/judge/bone_stretch.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "pipeline/scans/coarser.h"
#include "pipeline/scans/cubic_image.h"
#include "tests/support/ellipsoid_hinge.h"

namespace kvx {
namespace {
using namespace testing_support;

struct Planted {
  Hinge hinge;
  CubicImage image{hinge.world.template_scan->volume};
  std::vector<BoneTissue> tissue = SampleTissue(*hinge.world.bones, image, *hinge.weights);

  // The stretch of bone b, the world stretched so about its origin: F R = (rotation) U, U^2 = R^T F^2 R.
  Eigen::Matrix3d TruthOf(size_t b, const Eigen::Vector3d& times) const {
    const Eigen::Matrix3d turn = hinge.truth[b].rotation.toRotationMatrix();
    const Eigen::Matrix3d squared = turn.transpose() * times.cwiseAbs2().asDiagonal() * turn;
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(squared).operatorSqrt();
  }
  // Its rigid pose, centroid on centroid, turned as before.
  RigidTransform StartOf(size_t b, const Eigen::Vector3d& times) const {
    RigidTransform pose = hinge.truth[b];
    const PointMm centre = hinge.world.bones->bones[b].centroid;
    pose.translation_mm += (times.array() - 1).matrix().cwiseProduct((pose * centre).lps);
    return pose;
  }
};

TEST(BoneStretch, FindsAPlantedOneInEveryDirection) {
  const Planted planted;
  for (const Eigen::Vector3d& times : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1.04, 0.97, 1.01)}) {
    const CubicImage scan(Stretched(planted.hinge.Scan(), times));
    for (size_t b = 0; b < 2; ++b) {
      const auto found = StretchOf(planted.tissue[b], planted.image, scan, planted.StartOf(b, times));
      ASSERT_TRUE(found);
      EXPECT_LT((found->scan_of_template - planted.TruthOf(b, times)).cwiseAbs().maxCoeff(), 0.004)
          << b << "\n"
          << found->scan_of_template;
    }
  }
}

// What is blurred more seems to end farther in: unlike voxels are no other size.
TEST(BoneStretch, FindsNoneBetweenThinSlicesAndThickOnes) {
  const Planted planted;
  const Volume fine = planted.hinge.Scan();
  const VoxelBox all{Eigen::Vector3i::Zero(), fine.grid.size};
  for (const Eigen::Vector3i& block : {Eigen::Vector3i(3, 1, 1), Eigen::Vector3i(1, 3, 1),
                                       Eigen::Vector3i(1, 1, 2), Eigen::Vector3i(2, 2, 2)}) {
    const CubicImage scan(Coarser(fine, {all, block}));
    for (size_t b = 0; b < 2; ++b) {
      const auto found = StretchOf(planted.tissue[b], planted.image, scan, planted.hinge.truth[b]);
      ASSERT_TRUE(found);
      EXPECT_LT((found->scan_of_template - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 0.02)
          << block.transpose() << ", " << b << "\n"
          << found->scan_of_template;
    }
  }
}

// Errors over several noises lie about where the covariance says.
TEST(BoneStretch, TheSpreadIsNoMoreThanThreeTimesTooSmallUnderNoise) {
  const Planted planted;
  const Eigen::Vector3d times(1.03, 1.03, 0.98);
  double squares = 0, expected = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const CubicImage scan(Stretched(planted.hinge.Scan(12, seed), times));
    for (size_t b = 0; b < 2; ++b) {
      const auto found = StretchOf(planted.tissue[b], planted.image, scan, planted.StartOf(b, times));
      ASSERT_TRUE(found);
      const Eigen::Matrix3d error = found->scan_of_template - planted.TruthOf(b, times);
      for (int a = 0; a < 3; ++a) {
        squares += error(a, a) * error(a, a);
        expected += std::pow(SdAlong(*found, Eigen::Vector3d::Unit(a)), 2);
      }
    }
  }
  EXPECT_LT(squares, 9 * expected);
  EXPECT_GT(squares, expected / 8);
}

TEST(BoneStretch, NothingIsSaidOfABoneThatIsHardlyInView) {
  const Planted planted;
  RigidTransform away = planted.hinge.truth[0];
  away.translation_mm.x() -= 35;
  const CubicImage scan(planted.hinge.Scan());
  EXPECT_TRUE(StretchOf(planted.tissue[0], planted.image, scan, planted.hinge.truth[0]));
  EXPECT_FALSE(StretchOf(planted.tissue[0], planted.image, scan, away));
}

}  // namespace
}  // namespace kvx
