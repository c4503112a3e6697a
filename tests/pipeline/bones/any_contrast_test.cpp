// The curve of a scan's greys, learnt from a bone that nobody has placed.
#include "pipeline/bones/any_contrast.h"

#include <gtest/gtest.h>

#include "tests/support/ellipsoid_world.h"

namespace kvx {
namespace {
using namespace testing_support;

const RigidTransform kMoved = Exp((Twist() << 0.3, -0.2, 0.25, 6.0, -4.0, 3.0).finished());

const EllipsoidWorld& World() {
  static const EllipsoidWorld world(kOneBone, Box({64, 52, 46}, {1.0, 1.2, 1.3}, kOblique));
  return world;
}

Volume ScanBy(double (*curve)(double)) {
  Volume scan = Painted(Box({56, 56, 56}, {1.2, 1.2, 1.2}, kOblique), kOneBone, {kMoved});
  for (float& value : scan.values) value = float(curve(value));
  return scan;
}

std::optional<ContrastMap> Learnt(double (*curve)(double)) {
  const Volume scan = ScanBy(curve);
  const Volume& in_template = World().template_scan->volume;
  const SoughtBones sought = World().SoughtIn(scan);
  const BoneSearch search(sought, scan, SharedBackend(), {});
  return LearnContrast(search, in_template, scan);
}

// From a bone whose place is known.
std::optional<ContrastMap> LearntThere(double (*curve)(double), bool doubtful) {
  const Volume scan = ScanBy(curve);
  const Volume& in_template = World().template_scan->volume;
  const SoughtBones sought = World().SoughtIn(scan);
  const BoneSearch search(sought, scan, SharedBackend(), {});
  return ContrastOfBones(search, {{.scan_from_template = kMoved, .doubtful = doubtful}}, in_template, scan);
}

double Falling(double value) { return 250 - 1.3 * value; }
double Hump(double value) { return 200 - 0.02 * (value - 110) * (value - 110); }

// Alike up to gain and bias, as the scan is normalised, over the greys of tissue and marrow;
// a line has no part in the curve that rises and falls, and interpolated greys blur its top.
void ExpectLike(const std::optional<ContrastMap>& learnt, double (*curve)(double)) {
  ASSERT_TRUE(learnt.has_value());
  CorrelationSums sums;
  for (double value = 60; value <= 160; value += 5) {
    const float s = (*learnt)(float(value)), t = float(curve(value) / 100);
    sums.count += 1, sums.s += s, sums.t += t, sums.ss += s * s, sums.tt += t * t, sums.ts += s * t;
  }
  EXPECT_GT(Correlation(sums), 0.75);
}

TEST(AnyContrast, LearnsAFallingCurve) { ExpectLike(Learnt(Falling), Falling); }
TEST(AnyContrast, LearnsACurveThatRisesAndFalls) { ExpectLike(Learnt(Hump), Hump); }
TEST(AnyContrast, ReadsTheCurveOfBonesThatWereFound) {
  ExpectLike(LearntThere(Falling, false), Falling);
  ExpectLike(LearntThere(Hump, false), Hump);
  EXPECT_FALSE(LearntThere(Falling, true).has_value()) << "a doubtful bone tells nothing";
}
TEST(AnyContrast, ARisingLineNeedsNone) {
  EXPECT_FALSE(Learnt([](double value) { return 3 * value + 20; }).has_value());
}

}  // namespace
}  // namespace kvx
