// Shading goes, whatever its size; what has no coil stays.
#include "pipeline/bones/images/even_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "kernels/bone_scores.h"
#include "tests/support/ellipsoid_world.h"

namespace kvx {
namespace {
using namespace testing_support;

const Grid kView = Box({40, 36, 30}, {3, 3.2, 3.5}, kOblique);

// A ball in air, its tissue of two greys in turns.
Volume Ball(const std::function<double(const Eigen::Vector3d&)>& field) {
  Volume out(kView);
  for (size_t v = 0; v < out.values.size(); ++v) {
    const Eigen::Vector3d x = kView.ToMm(PointVox{kView.Ijk(v).cast<double>()}).lps;
    const double tissue = 100 + 30 * (std::sin(0.8 * x.x()) * std::sin(0.7 * x.y()) > 0 ? 1 : -1);
    out.values[v] = float(x.norm() < 48 ? tissue * field(x) : 4);
  }
  return out;
}

double Even(const Eigen::Vector3d&) { return 1; }
double Shade(const Eigen::Vector3d& x) {
  return 1 + 0.008 * x.x() - 0.003 * x.z();
}  // 0.6 to 1.4 in the ball

Volume Lit(const Volume& volume) {
  Scan scan;
  scan.volume = volume;
  return EvenlyLit(scan);
}

double CorrelationInside(const Volume& a, const Volume& b) {
  CorrelationSums sums;
  for (size_t v = 0; v < a.values.size(); ++v) {
    if (kView.ToMm(PointVox{kView.Ijk(v).cast<double>()}).lps.norm() > 46) continue;
    const float s = a.values[v] / 100 - 1, t = b.values[v] / 100 - 1;
    sums.count += 1, sums.s += s, sums.t += t, sums.ss += s * s, sums.tt += t * t, sums.ts += s * t;
  }
  return Correlation(sums);
}

TEST(EvenLight, ShadingGoesAndTissueStays) {
  const Volume even = Ball(Even), shaded = Ball(Shade);
  EXPECT_LT(CorrelationInside(shaded, even), 0.87);
  EXPECT_GT(CorrelationInside(Lit(shaded), even), 0.95);
  EXPECT_GT(CorrelationInside(Lit(shaded), Lit(even)), 0.95);
  EXPECT_GT(CorrelationInside(Lit(even), even), 0.99) << "what was even is left alone";
}

TEST(EvenLight, AirStaysDark) {
  const Volume lit = Lit(Ball(Shade));
  for (size_t v = 0; v < lit.values.size(); ++v) {
    if (kView.ToMm(PointVox{kView.Ijk(v).cast<double>()}).lps.norm() > 50) {
      EXPECT_NEAR(lit.values[v], 4, 1e-3);
    }
  }
}

TEST(EvenLight, AGainIsOnlyAGain) {
  const Volume once = Ball(Shade), twice = Ball([](const Eigen::Vector3d&x) { return 2 * Shade(x); });
  Volume doubled = once;
  for (float& value : doubled.values) value *= 2;
  const Volume a = Lit(once), b = Lit(doubled);
  for (size_t v = 0; v < a.values.size(); v += 7) EXPECT_NEAR(b.values[v], 2 * a.values[v], 1e-2);
  EXPECT_GT(CorrelationInside(Lit(twice), a), 0.999);
}

TEST(EvenLight, HounsfieldUnitsStayAsTheyAre) {
  Volume ct = Ball(Even);
  for (float& value : ct.values) value -= 1000;
  EXPECT_EQ(Lit(ct).values, ct.values);
}

TEST(EvenLight, WithoutAirNothingChanges) {
  Volume inside = Ball(Shade);
  for (float& value : inside.values) value = std::max(value, 60.0f);
  EXPECT_EQ(Lit(inside).values, inside.values);
}

TEST(EvenLight, AnEvenImageStaysFinite) {
  const Volume flat(kView, 7.0f);
  for (const float value : Lit(flat).values) EXPECT_TRUE(std::isfinite(value));
}

}  // namespace
}  // namespace kvx
