// Two noisy volumes of a textured ball, without bones: bent by a known motion, from a rigid start.
#include "pipeline/registration/register_volumes.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

const Eigen::Vector3d kCentre(36, 36, 36);
constexpr double kRadius = 26, kSpacing = 1.8;

double Intensity(const Eigen::Vector3d& x) {
  const double edge = 1 / (1 + std::exp(((x - kCentre).norm() - kRadius) / 0.8));
  return edge * (100 + 20 * std::sin(0.35 * x.x() + 0.2 * x.y()) * std::cos(0.3 * x.y() - 0.15 * x.z()) +
                 20 * std::sin(0.4 * x.z() + 0.25 * x.x()));
}

// The upper half turns about x, more the higher it lies.
Eigen::Vector3d Bent(const Eigen::Vector3d& x, double sign) {
  const double angle = sign * 0.013 * std::max(0.0, x.z() - kCentre.z());
  return kCentre + Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()) * (x - kCentre);
}
Eigen::Vector3d Unbent(const Eigen::Vector3d& y) {
  Eigen::Vector3d x = y;
  for (int n = 0; n < 50; ++n) x += 0.7 * (y - Bent(x, 1));
  return x;
}

template <class Motion>  // scan world -> template world
Scan Render(Motion template_from_scan, unsigned seed) {
  Grid grid;
  grid.size = {40, 40, 40};
  grid.spacing_mm = Eigen::Vector3d::Constant(kSpacing);
  Scan scan;
  scan.volume = Volume(grid);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 3);
  for (size_t v = 0; v < scan.volume.values.size(); ++v) {
    const Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    scan.volume.values[v] = float(Intensity(template_from_scan(x)) + noise(random));
  }
  return scan;
}

// Means over the ball in mm, before and after.
template <class Truth>
std::pair<double, double> Errors(const RegisteredScan& result, Truth scan_from_template) {
  double before = 0, after = 0, n = 0;
  const Grid& grid = result.scan_from_template.grid;
  for (size_t v = 0; v < result.scan_from_template.values.size(); ++v) {
    const Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    if ((x - kCentre).norm() > kRadius) continue;
    const Eigen::Vector3d truth = scan_from_template(x) - x;
    before += truth.norm();
    after += (result.scan_from_template.values[v].cast<double>() - truth).norm();
    n += 1;
  }
  return {before / n, after / n};
}

TEST(RegisterVolumes, ABendIsFoundFromNothing) {
  StageContext context{SharedBackend(), {}};
  const Scan fixed = Render([](const auto&x) { return x; }, 1), moving = Render(Unbent, 2);
  const RegisteredScan result = RegisterVolumes(fixed, moving, {}, {}, context);
  const auto [before, after] = Errors(result, [](const auto& x) { return Bent(x, 1); });
  EXPECT_GT(before, 1.0);
  EXPECT_LT(after, 0.25 * kSpacing);
  EXPECT_EQ(result.folded_fraction, 0);
}

TEST(RegisterVolumes, TheRigidStartIsKeptWhereItIsRight) {
  StageContext context{SharedBackend(), {}};
  RigidTransform start;  // scan_from_template
  start.rotation = Eigen::AngleAxisd(std::numbers::pi / 5, Eigen::Vector3d(1, 2, -1).normalized());
  start.translation_mm = kCentre - start.rotation * kCentre + Eigen::Vector3d(2, -3, 1);
  const auto moved = [&](const Eigen::Vector3d& x) { return (start * PointMm{x}).lps; };
  const Scan fixed = Render([](const auto& x) { return x; }, 1);
  const Scan moving = Render([&](const Eigen::Vector3d& y) { return (start.Inverse() * PointMm{y}).lps; }, 2);
  const auto [before, after] = Errors(RegisterVolumes(fixed, moving, start, {}, context), moved);
  EXPECT_GT(before, 5);
  EXPECT_LT(after, 0.15 * kSpacing);
}

}  // namespace
}  // namespace kvx
