// Greys of which origin and shading are known.
#include "pipeline/registration/images/scan_origin.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace kvx {
namespace {

constexpr double kNoise = 3;

// Muscle of 80, fat of 200 and what lies between; a third of it misplaced. `shade` over the place, which goes
// from -1 to 1 along every axis.
template <class Shade>
std::vector<ShadingSample> Samples(double origin, Shade shade) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-1, 1), tissue(0, 3);
  std::normal_distribution<double> noise(0, kNoise);
  const auto grey = [&] { return 80 + 120 * std::clamp(tissue(random) - 1, 0.0, 1.0); };
  std::vector<ShadingSample> samples;
  for (int n = 0; n < 30000; ++n) {
    const Eigen::Vector3d x(place(random), place(random), place(random));
    const double in_template = grey(), in_scan = n % 3 == 0 ? grey() : in_template;
    samples.push_back({100 * x, in_template + noise(random), origin + shade(x) * in_scan + noise(random)});
  }
  return samples;
}

double Even(const Eigen::Vector3d&) { return 1.3; }
double Coil(const Eigen::Vector3d& x) { return std::exp(0.5 * x.x() - 0.2 * x.z() * x.z()); }

TEST(ScanOrigin, IsFoundBesideShadingAndMisplacedTissue) {
  for (const double origin : {-60.0, 0.0, 45.0}) {
    EXPECT_NEAR(FitScanOrigin(Samples(origin, Even)), origin, 4);
    EXPECT_NEAR(FitScanOrigin(Samples(origin, Coil)), origin, 6);
  }
}

TEST(ScanOrigin, IsWhereTheTemplateHasItWhereNothingTells) {
  EXPECT_EQ(FitScanOrigin({}), 0);
  std::vector<ShadingSample> few = Samples(-60, Even);
  few.resize(100);
  EXPECT_EQ(FitScanOrigin(few), 0);
  std::vector<ShadingSample> dark = Samples(0, Even);
  for (ShadingSample& sample : dark) sample.template_value = 0;
  EXPECT_EQ(FitScanOrigin(dark), 0);
}

}  // namespace
}  // namespace kvx
