// One bone's samples against a curved scan: where steps lead, and whether they end where differences of the
// squares themselves say (eq. 1; these are least where the correlation is largest).
#include "pipeline/bones/refine/refine_bone.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;
using Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

constexpr double kRadiusMm = 10;

// Read linearly between voxels it is what it is, and as smooth: there are no powers of one coordinate.
double Curved(const Vector3d& p) {
  return 0.05 * p.x() - 0.04 * p.y() + 0.06 * p.z() + 0.03 * p.x() * p.y() - 0.035 * p.y() * p.z() +
         0.025 * p.z() * p.x() + 0.004 * p.x() * p.y() * p.z();
}

// A scan on a grid that is askew to the samples, which are scattered over a ball.
struct World {
  Volume scan{ObliqueGrid({64, 46, 36})};
  BoneSamples samples;
  RigidTransform truth;  // scan_from_template

  // `noise`: standard deviation of what the template shows besides.
  explicit World(double noise) {
    truth.rotation = Eigen::AngleAxisd(0.7, Vector3d(1, 2, -1).normalized());
    samples.centre_mm = {40, -20, 10};
    truth.translation_mm = scan.grid.Middle().lps - truth.rotation * samples.centre_mm;
    for (size_t v = 0; v < scan.values.size(); ++v)
      scan.values[v] =
          float(Curved(scan.grid.Ijk(v).cast<double>() - scan.grid.ToVox(scan.grid.Middle()).ijk));
    std::mt19937 random(3);
    std::uniform_real_distribution<double> place(-kRadiusMm, kRadiusMm);
    std::normal_distribution<double> normal(0, noise);
    while (samples.points.size() < 4000) {
      const Vector3d x(place(random), place(random), place(random));
      if (x.norm() > kRadiusMm) continue;
      const PointVox at = scan.grid.ToVox(truth * PointMm{samples.centre_mm + x});
      BoneSample sample;
      sample << x.cast<float>(), float(0.7 * SampleTrilinear(scan, at) + 0.1 + normal(random));
      samples.points.push_back(sample);
    }
  }
  // A turn about the bone's centre, times the radius, and a shift; mm in the scan.
  RigidTransform Moved(const RigidTransform& pose, const Twist& by_mm) const {
    const PointMm centre = pose * PointMm{samples.centre_mm};
    RigidTransform turn = RotationAbout(centre, by_mm.head<3>(), by_mm.head<3>().norm() / kRadiusMm);
    turn.translation_mm += by_mm.tail<3>();
    return turn * pose;
  }
  Twist Between(const RigidTransform& from, const RigidTransform& to) const {
    Twist out;
    out << kRadiusMm * RotationVector((to * from.Inverse()).rotation),
        (to * PointMm{samples.centre_mm}).lps - (from * PointMm{samples.centre_mm}).lps;
    return out;
  }
  // Sum of squares after the best gain and bias, as a part of the template's.
  double Squares(const RigidTransform& pose) const {
    const PoseFit fit = FitAt(scan, samples, pose);
    EXPECT_EQ(fit.inside, 1);
    return 1 - fit.correlation * fit.correlation;
  }
  Twist Slope(const RigidTransform& at, double step_mm) const {
    Twist out;
    for (int n = 0; n < 6; ++n) {
      const Twist u = step_mm * Twist::Unit(n);
      out[n] = (Squares(Moved(at, u)) - Squares(Moved(at, -u))) / (2 * step_mm);
    }
    return out;
  }
  Matrix6d Curvature(const RigidTransform& at, double step_mm) const {
    Matrix6d out;
    for (int n = 0; n < 6; ++n) {
      for (int m = 0; m < 6; ++m) {
        const Twist u = step_mm * Twist::Unit(n), w = step_mm * Twist::Unit(m);
        out(n, m) = (Squares(Moved(at, u + w)) + Squares(Moved(at, -u - w)) - Squares(Moved(at, u - w)) -
                     Squares(Moved(at, w - u))) /
                    (4 * step_mm * step_mm);
      }
    }
    return out;
  }
};

// Where the images agree Gauss-Newton's matrix is the curvature, and a step leads back; what it goes wrong by
// as slopes change on the way is the same from both sides, up to (k x)^2 of the way x, of which every step
// has a thousandth less for its damping. k: second derivatives of the scan by its slopes.
TEST(RefinePose, AStepLeadsBackWhereImagesAgree) {
  const World world(0);
  constexpr double kPerMm = 0.25;
  const auto step_mm = [&](const Twist& off_mm) {
    const RigidTransform start = world.Moved(world.truth, off_mm);
    EXPECT_GT(world.Squares(start), 0.002);  // from a correlation of 0.999 on, all are as good
    return world.Between(start, RefinePose(world.scan, world.samples, start, 1).scan_from_template);
  };
  for (int n = 0; n < 12; ++n) {
    Twist off_mm = 0.5 * Twist::Unit(n % 6);
    for (int m = 0; n >= 6 && m < 6; ++m) off_mm[m] = 0.4 * std::cos(2.0 * n + 1.7 * m);
    const Twist gone_mm = 0.5 * (step_mm(off_mm) - step_mm(-off_mm));
    const double way_mm = off_mm.norm();
    EXPECT_LT((gone_mm + off_mm).norm() / way_mm, std::pow(kPerMm * way_mm, 2) + 1e-3) << off_mm.transpose();
  }
}

// Where the template shows more than the scan it ends elsewhere, and there squares are flat: the way to where
// differences have their slope at 0. Sums in single precision tell squares apart by a ten-millionth, which is
// what they rise by over 2 micrometres.
TEST(RefinePose, EndsWhereTheSquaresAreFlat) {
  const World world(0.7);
  for (const double side : {1.0, -1.0}) {
    const Twist off_mm = side * (Twist() << 1, -0.8, 0.5, 0.8, 1, -0.5).finished();
    const RigidTransform end =
        RefinePose(world.scan, world.samples, world.Moved(world.truth, off_mm), 30).scan_from_template;
    EXPECT_GT(world.Between(world.truth, end).norm(), 0.3);
    const Twist way_mm = world.Curvature(end, 0.2).llt().solve(world.Slope(end, 0.1));
    EXPECT_LT(way_mm.norm(), 3e-3) << side;
  }
}

}  // namespace
}  // namespace kvx
