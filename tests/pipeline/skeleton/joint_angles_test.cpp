// Angles give rotations back, are those that were planted, and never go round more than half way.
#include "pipeline/skeleton/joint_angles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace kvx {
namespace {

using Axes = std::vector<Eigen::Vector3d>;

class JointAnglesOf : public testing::Test {
 protected:
  double Number() { return std::uniform_real_distribution(-1.0, 1.0)(random_); }
  Eigen::Quaterniond AnyRotation() {
    std::normal_distribution<double> normal;
    Eigen::Vector4d q;
    for (int i = 0; i < 4; ++i) q[i] = normal(random_);
    return Eigen::Quaterniond(q.normalized());
  }
  // At right angles, of either hand.
  Axes AnyFrame() {
    const Eigen::Matrix3d frame = AnyRotation().toRotationMatrix();
    return {frame.col(0), frame.col(1), Number() < 0 ? -frame.col(2) : Eigen::Vector3d(frame.col(2))};
  }
  static Eigen::Quaterniond Product(const Axes& axes, const Eigen::VectorXd& angles) {
    Eigen::Quaterniond product = Eigen::Quaterniond::Identity();
    for (size_t d = 0; d < axes.size(); ++d)
      product = product * Eigen::AngleAxisd(angles[Eigen::Index(d)], axes[d]);
    return product;
  }
  std::mt19937 random_{7};
};

TEST_F(JointAnglesOf, ThreeAxesGiveEveryRotationBackWithinHalfATurn) {
  for (int trial = 0; trial < 300; ++trial) {
    const Axes axes = AnyFrame();
    const Eigen::Quaterniond rotation = AnyRotation();
    const Eigen::VectorXd angles = AnglesOf(axes, rotation);
    EXPECT_LT(Product(axes, angles).angularDistance(rotation), 1e-7);
    EXPECT_LE(angles.cwiseAbs().maxCoeff(), kPi + 1e-9);
    EXPECT_LE(std::abs(angles[1]), kPi / 2 + 1e-9);
  }
}

TEST_F(JointAnglesOf, ThreeAxesGiveARotationBackWhoseSecondAngleIsARightOne) {
  for (int trial = 0; trial < 50; ++trial) {
    const Axes axes = AnyFrame();
    const Eigen::Quaterniond rotation = Product(axes, Eigen::Vector3d(3 * Number(), kPi / 2, 3 * Number()));
    EXPECT_LT(Product(axes, AnglesOf(axes, rotation)).angularDistance(rotation), 1e-7);
  }
}

// A shoulder: lifted to 170 degrees, aside by 70, turned by 60.
TEST_F(JointAnglesOf, ThreeAnglesThatGrowComeBackAsTheyGrow) {
  const Axes axes = AnyFrame();
  for (double part = 0; part <= 1; part += 0.01) {
    const Eigen::Vector3d planted = part * Eigen::Vector3d(RadFromDeg(170), RadFromDeg(-70), RadFromDeg(60));
    EXPECT_LT((AnglesOf(axes, Product(axes, planted)) - planted).norm(), 1e-7);
  }
}

TEST_F(JointAnglesOf, OneAndTwoAxesComeBackAsPlanted) {
  for (int trial = 0; trial < 100; ++trial) {
    Axes axes = AnyFrame();
    axes.pop_back();
    axes[1] = (axes[1] + 0.6 * Number() * axes[0]).normalized();  // not quite at right angles
    const Eigen::Vector2d planted = 0.99 * kPi * Eigen::Vector2d(Number(), Number());
    EXPECT_LT((AnglesOf(axes, Product(axes, planted)) - planted).norm(), 1e-7);
    axes.pop_back();
    EXPECT_NEAR(AnglesOf(axes, Product(axes, planted.head<1>()))[0], planted[0], 1e-9);
  }
}

// No angles nearby, and none on a grid over all of them, bring two axes closer to a rotation.
TEST_F(JointAnglesOf, TwoAxesComeAsCloseAsTheyCan) {
  for (int trial = 0; trial < 20; ++trial) {
    Axes axes = AnyFrame();
    axes.pop_back();
    const Eigen::Quaterniond rotation = AnyRotation();
    const double off = Product(axes, AnglesOf(axes, rotation)).angularDistance(rotation);
    double least = kPi;
    for (double a = -kPi; a < kPi; a += 0.1) {
      for (double b = -kPi; b < kPi; b += 0.1)
        least = std::min(least, Product(axes, Eigen::Vector2d(a, b)).angularDistance(rotation));
    }
    EXPECT_LT(off, least + 1e-9);
  }
}

// As a bone that is bent, spread and turned about a length that is not quite across the others.
TEST_F(JointAnglesOf, ThreeAxesAskewComeBackAsPlanted) {
  const Axes axes = {Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY(),
                     Eigen::Vector3d(0.97, 0.15, -0.2).normalized()};
  for (const double bend_deg : {-40.0, 5.0, 60.0, 110.0}) {
    const Eigen::Vector3d planted(RadFromDeg(bend_deg), RadFromDeg(12), RadFromDeg(0.1 * bend_deg));
    EXPECT_LT((AnglesOf(axes, Product(axes, planted)) - planted).norm(), 1e-7);
  }
}

TEST_F(JointAnglesOf, OfTwoAxesThatAreOneTheFirstTurns) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 3).normalized();
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(RadFromDeg(50), axis));
  const Eigen::VectorXd angles = AnglesOf(Axes{axis, axis}, rotation);
  EXPECT_NEAR(DegFromRad(angles[0]), 50, 1e-9);
  EXPECT_EQ(angles[1], 0);
}

}  // namespace
}  // namespace kvx
