// The clamped plate spline against closed forms, and its basis against what interpolation must give.
#include "core/clamped_plate_spline.h"

#include <gtest/gtest.h>

#include <random>

namespace kvx {
namespace {

std::vector<Eigen::Vector3d> PointsInBall(int count, double radius = 0.95) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-radius, radius);
  std::vector<Eigen::Vector3d> points;
  while (int(points.size()) < count) {
    const Eigen::Vector3d p(uniform(random), uniform(random), uniform(random));
    if (p.norm() < radius) points.push_back(p);
  }
  return points;
}

// The paper's form: |x - y| (A + 1/A - 2).
double PaperGreen(const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
  const double d = (x - y).norm();
  const double a = std::sqrt(x.squaredNorm() * y.squaredNorm() - 2 * x.dot(y) + 1) / d;
  return d * (a + 1 / a - 2);
}

TEST(ClampedPlateSpline, AroundTheCentreItIsOneMinusRSquared) {
  for (const double r : {0.0, 0.1, 0.5, 0.9, 1.0}) {
    EXPECT_NEAR(ClampedPlateGreen({r, 0, 0}, {0, 0, 0}), (1 - r) * (1 - r), 1e-12) << "r = " << r;
  }
}

TEST(ClampedPlateSpline, AtItsOwnPoleItIsOneMinusTheSquaredRadius) {
  for (const Eigen::Vector3d& x : PointsInBall(20))
    EXPECT_NEAR(ClampedPlateGreen(x, x), 1 - x.squaredNorm(), 1e-12);
}

TEST(ClampedPlateSpline, AgreesWithThePapersFormAndIsSymmetric) {
  const auto points = PointsInBall(40);
  for (size_t i = 0; i + 1 < points.size(); ++i) {
    EXPECT_NEAR(ClampedPlateGreen(points[i], points[i + 1]), PaperGreen(points[i], points[i + 1]), 1e-9);
    EXPECT_DOUBLE_EQ(ClampedPlateGreen(points[i], points[i + 1]),
                     ClampedPlateGreen(points[i + 1], points[i]));
  }
}

TEST(ClampedPlateSpline, ValueAndSlopeVanishOnTheSphere) {
  for (const Eigen::Vector3d& y : PointsInBall(20)) {
    for (const Eigen::Vector3d& p : PointsInBall(5)) {
      const Eigen::Vector3d x = p.normalized();
      EXPECT_NEAR(ClampedPlateGreen((1 - 1e-6) * x, y), 0, 1e-10);  // a slope below 1e-4
      EXPECT_EQ(ClampedPlateGreen(1.0001 * x, y), 0.0);
    }
  }
}

TEST(BlockSpline, InterpolatesItsControlPointsExactly) {
  const BlockSpline spline;
  for (int a = 0; a < kControlPoints; ++a) {
    const ControlRow row = spline.Basis(spline.control_points()[a]);
    for (int b = 0; b < kControlPoints; ++b) EXPECT_NEAR(row[b], a == b ? 1.0 : 0.0, 1e-12);
  }
  EXPECT_NEAR(spline.SelfEnergy(), ClampedPlateGreen(spline.control_points()[3], spline.control_points()[3]),
              1e-12);
}

TEST(BlockSpline, ControlPointsLieInsideTheCornersOfTheCentreBlock) {
  const BlockSpline spline(0.15);
  for (const Eigen::Vector3d& c : spline.control_points()) {
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(std::abs(c[a]) * 1.5, 0.35, 1e-12);
  }
}

// Midpoint rule over a fine lattice, laplacian by finite differences of the basis.
TEST(BlockSpline, BendingEnergyIsTheIntegralOfTheSquaredLaplacian) {
  const BlockSpline spline;
  Eigen::Matrix<double, kControlPoints, 1> f;
  f << 1, -0.5, 0.3, 0.8, -0.2, 0.4, 0.9, 0.1;
  constexpr int kCells = 60;
  constexpr double kStep = 2.0 / kCells;
  std::vector<double> u((kCells + 1) * (kCells + 1) * (kCells + 1));
  const auto at = [](int i, int j, int k) { return (size_t(k) * (kCells + 1) + j) * (kCells + 1) + i; };
  for (int k = 0; k <= kCells; ++k) {
    for (int j = 0; j <= kCells; ++j) {
      for (int i = 0; i <= kCells; ++i) {
        u[at(i, j, k)] = spline.Basis(Eigen::Vector3d(i, j, k) * kStep - Eigen::Vector3d::Ones()) * f;
      }
    }
  }
  double integral = 0;
  for (int k = 1; k < kCells; ++k) {
    for (int j = 1; j < kCells; ++j) {
      for (int i = 1; i < kCells; ++i) {
        const double laplacian =
            (u[at(i - 1, j, k)] + u[at(i + 1, j, k)] + u[at(i, j - 1, k)] + u[at(i, j + 1, k)] +
             u[at(i, j, k - 1)] + u[at(i, j, k + 1)] - 6 * u[at(i, j, k)]) /
            (kStep * kStep);
        integral += laplacian * laplacian * kStep * kStep * kStep;
      }
    }
  }
  const double exact = f.dot(spline.BendingEnergy() * f);
  EXPECT_NEAR(integral / exact, 1.0, 0.05);
}

}  // namespace
}  // namespace kvx
