// Variances of one joint and one scan, whose most likely values can be written down.
#include "pipeline/examples/joint_relevance.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

Eigen::MatrixXd Number(double value) { return Eigen::MatrixXd::Constant(1, 1, value); }

// One scan, of which one term and hardly any noise say something: the examples are as 30 voxels with the mean
// square 1, what is assumed (100) as 0.3 of them. d/df of 30 (log f + 1/f) + 0.3 (log f + 100/f) is 0
// where 30.3 f = 30 + 30.
TEST(LearnVariances, ExamplesCountAsThirtyVoxels) {
  const Variances assumed{Eigen::Vector2d(100, 5), 1e-9, Eigen::VectorXd::Ones(1)};
  const Variances learned = LearnVariances({Number(1), Number(0)}, Number(7), {0}, assumed);
  EXPECT_NEAR(learned.shared[0], 60 / 30.3, 1e-4);
  EXPECT_NEAR(learned.shared[1], 5, 1e-9) << "of what no scan shows, what was assumed";
  EXPECT_LT(learned.own, 1e-8);
}

// Each scan's noise goes with the displacement that it shows, of which a tenth of a typical one is always
// there.
TEST(LearnVariances, NoiseIsSharedOutByWhatScansShow) {
  const Eigen::MatrixXd moments = Eigen::Vector3d(6, 0, 3).asDiagonal();
  const Variances assumed{Eigen::Vector2d(1, 1), 0.03, Eigen::VectorXd::Ones(4)};
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(4, 4);
  all.topLeftCorner<3, 3>() = moments;
  all(3, 3) = 1000;  // does not show the bone
  const std::vector<Eigen::MatrixXd> shared(2, Eigen::MatrixXd::Identity(4, 4));
  const Variances learned = LearnVariances(shared, all, {0, 1, 2}, assumed);
  EXPECT_NEAR(learned.share[0], 2.1, 1e-12);
  EXPECT_NEAR(learned.share[1], 0.1, 1e-12);
  EXPECT_NEAR(learned.share[2], 1.1, 1e-12);
  EXPECT_EQ(learned.share[3], 1);
}

TEST(LearnVariances, MomentsOfNoSizeTeachNothing) {
  const Variances assumed{Eigen::Vector2d(2, 3), 0.4, Eigen::VectorXd::Ones(1)};
  const Variances learned = LearnVariances({Number(1), Number(1)}, Number(0), {0}, assumed);
  EXPECT_EQ(learned.shared, assumed.shared);
  EXPECT_EQ(learned.own, 0.4);
}

}  // namespace
}  // namespace kvx
