// The curve of a scan's greys, learnt from a bone that nobody has placed.
#include "pipeline/bones/search/any_contrast.h"

#include <gtest/gtest.h>

#include <random>

#include "pipeline/bones/images/outer_air.h"
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

std::optional<LearntContrast> LearntFrom(const EllipsoidWorld& world, const Volume& scan) {
  const Volume& in_template = world.template_scan->volume;
  const SoughtBones sought = world.SoughtIn(scan);
  const BoneSearch search(sought, scan, SharedBackend(), {});
  const double voxel_mm = sought.FirstLevelMm(0);
  const SeenAir air{OuterAir(in_template, "MR", voxel_mm), OuterAir(scan, "MR", voxel_mm)};
  return LearnContrast(search, in_template, scan, air, SharedBackend());
}

TEST(AnyContrast, StopsBetweenItsPoses) {
  const Volume& in_template = World().template_scan->volume;
  const Volume scan = Painted(Box({56, 56, 56}, {1.2, 1.2, 1.2}, kOblique), kOneBone, {kMoved});
  const SoughtBones sought = World().SoughtIn(scan);
  int asked = 0;
  const Progress stopped({}, [&] { return ++asked > 2; });
  const BoneSearch search(sought, scan, SharedBackend(), {}, stopped);
  const SeenAir air{OuterAir(in_template, "MR", 2), OuterAir(scan, "MR", 2)};
  EXPECT_THROW(LearnContrast(search, in_template, scan, air, SharedBackend()), Cancelled);
}

std::optional<ContrastMap> Learnt(double (*curve)(double)) {
  const auto learnt = LearntFrom(World(), ScanBy(curve));
  if (!learnt) return std::nullopt;
  return learnt->scan_of_template;
}

// From a bone whose place is known.
std::optional<ContrastMap> LearntThere(double (*curve)(double), bool doubtful) {
  const Volume scan = ScanBy(curve);
  const Volume& in_template = World().template_scan->volume;
  const SoughtBones sought = World().SoughtIn(scan);
  const BoneSearch search(sought, scan, SharedBackend(), {});
  return ContrastOfBones(search,
                         {{.scan_from_template = kMoved, .doubt = doubtful ? Doubt::kBone : Doubt::kNone}},
                         in_template, scan);
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

const std::vector<Ellipsoid> kThickBone{{"bone", "", {2, -1, 1}, {26, 15, 13}}};

// Beyond a cylinder about the bone is air, and its noise.
Volume AsLimb(Volume tissue, const RigidTransform& pose) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 2);
  for (size_t v = 0; v < tissue.values.size(); ++v) {
    const PointMm x = tissue.grid.ToMm(PointVox{tissue.grid.Ijk(v).cast<double>()});
    const Eigen::Vector3d from_bone = (pose.Inverse() * x).lps - kThickBone[0].centre_mm;
    if (Eigen::Vector2d((from_bone.y() + 4) / 23, (from_bone.z() - 2) / 18).norm() > 1)
      tissue.values[v] = float(std::abs(5 + normal(random)));
  }
  return tissue;
}

TEST(AnyContrast, FindsTheBoneOfALimbInAir) {
  EllipsoidWorld limb(kThickBone, Box({70, 70, 70}, {1.4, 1.4, 1.4}, kOblique));
  auto in_template = std::make_shared<Scan>(*limb.template_scan);
  in_template->volume = AsLimb(in_template->volume, RigidTransform{});
  limb.template_scan.value = in_template;
  for (double (*curve)(double) :
       {Falling, +[](double value) { return 200 - 0.03 * (value - 95) * (value - 95); }}) {
    Volume scan = Painted(Box({70, 70, 70}, {1.5, 1.5, 1.5}, kOblique), kThickBone, {kMoved});
    for (float& value : scan.values) value = float(curve(value));
    const auto learnt = LearntFrom(limb, AsLimb(std::move(scan), kMoved));
    ASSERT_TRUE(learnt.has_value());
    EXPECT_LT(CentreMm(learnt->root, kMoved, PointMm{kThickBone[0].centre_mm}), 1.2);
    EXPECT_LT(AngleDeg(learnt->root, kMoved), 3);
    ExpectLike(learnt->scan_of_template, curve);
  }
}

}  // namespace
}  // namespace kvx
