// Scans that differ from the template by more than a pose: every bone is found, or said to be doubtful.
#include <gtest/gtest.h>

#include <random>

#include "pipeline/bones/register_bones.h"
#include "tests/support/ellipsoid_world.h"

namespace kvx {
namespace {
using namespace testing_support;

constexpr double kVoxelMm = 1.2;
// A thin finger on a thick root.
const std::vector<Ellipsoid> kFinger{{"palm", "", {-26, 0, 0}, {17, 11, 8}},
                                     {"first", "palm", {0, 0, 0}, {8.5, 4.2, 3.8}},
                                     {"second", "first", {14.5, 0, 0}, {6.5, 3.8, 3.4}},
                                     {"last", "second", {25, 0, 0}, {4.6, 3.5, 3.0}}};

const EllipsoidWorld& Finger() {
  static const EllipsoidWorld world(
      kFinger, Box({72, 36, 30}, {kVoxelMm, kVoxelMm, 1.3}, Eigen::Matrix3d::Identity()));
  return world;
}

// The finger bent at its three joints, all of it moved by `root`.
PoseVector Bent(const RigidTransform& root, const std::array<double, 3>& degrees) {
  PoseVector pose{root};
  const std::array<double, 3> joints_mm{-9, 7.8, 20.6};
  for (size_t j = 0; j < joints_mm.size(); ++j) {
    pose.push_back(pose.back() *
                   RotationAbout(PointMm{{joints_mm[j], 0, 0}}, {0, 0, 1}, RadFromDeg(degrees[j])));
  }
  return pose;
}

Volume Scanned(const PoseVector& pose) {
  return Painted(Box({66, 66, 34}, {1.3, 1.3, 1.3}, kOblique), kFinger, pose);
}

// How far the bone's ends and sides lie from where they belong, root mean square.
double OffMm(const BoneFit& fit, const RigidTransform& truth, size_t b) {
  double squares = 0;
  for (int n = 0; n < 6; ++n) {
    const PointMm x{kFinger[b].centre_mm +
                    (n % 2 ? 1 : -1) * kFinger[b].half_mm[n / 2] * Eigen::Vector3d::Unit(n / 2)};
    squares += ((fit.scan_from_template * x).lps - (truth * x).lps).squaredNorm();
  }
  return std::sqrt(squares / 6);
}

// By the search alone: around a bent bone its tissue lies elsewhere, of which refinement makes up for the
// rest.
void ExpectRightOrFlagged(const BoneFits& fits, const PoseVector& truth, size_t at_least_right) {
  size_t right = 0;
  std::string seen;
  for (size_t b = 0; b < fits.size(); ++b) {
    const double off_mm = OffMm(fits[b], truth[b], b);
    const bool large = Finger().bones->bones[b].voxels >= 300;
    const bool is_right = off_mm < (large ? 0.7 : 1.0) * kVoxelMm;
    right += is_right;
    EXPECT_TRUE(is_right || fits[b].Doubtful())
        << kFinger[b].name << " is silently off by " << off_mm << " mm";
    if (!is_right)
      seen += " " + kFinger[b].name + ": " + fits[b].note + ", off by " + std::to_string(off_mm) + " mm";
  }
  EXPECT_GE(right, at_least_right) << seen;
}

const RigidTransform kRoot = Exp((Twist() << 0.1, -0.15, 0.2, 3.0, -2.0, 1.5).finished());

TEST(RobustBones, AThinFingerCurledUp) {
  const PoseVector truth = Bent(kRoot, {65, 75, 40});
  ExpectRightOrFlagged(Finger().Register(Scanned(truth)), truth, 3);
}

// A tree as somebody in a hurry draws it: every bone hangs on the palm.
TEST(RobustBones, AThinFingerOfWhichEveryBoneHangsOnThePalm) {
  std::vector<Ellipsoid> star = kFinger;
  for (size_t b = 1; b < star.size(); ++b) star[b].parent = "palm";
  const EllipsoidWorld world(star, Box({72, 36, 30}, {kVoxelMm, kVoxelMm, 1.3}, Eigen::Matrix3d::Identity()));
  const PoseVector truth = Bent(kRoot, {65, 75, 40});
  ExpectRightOrFlagged(world.Register(Scanned(truth)), truth, 3);
}

TEST(RobustBones, SixtyDegreesBetweenTheScans) {
  const RigidTransform root{
      Eigen::Quaterniond(Eigen::AngleAxisd(RadFromDeg(60), Eigen::Vector3d(1, 2, -1).normalized())),
      {6, -8, 4}};
  const PoseVector truth = Bent(root, {20, 25, 15});
  ExpectRightOrFlagged(
      Finger().Register(Painted(Box({78, 78, 60}, {1.3, 1.3, 1.3}, kOblique), kFinger, truth)), truth, 4);
}

TEST(RobustBones, Noise) {  // signal to noise 8: marrow of 150 against 19
  const PoseVector truth = Bent(kRoot, {30, 40, 20});
  Volume scan = Scanned(truth);
  std::mt19937 random(11);
  std::normal_distribution<float> noise(0.0f, 19.0f);
  for (float& value : scan.values) value += noise(random);
  ExpectRightOrFlagged(Finger().Register(scan), truth, 3);
}

TEST(RobustBones, Blur) {
  const PoseVector truth = Bent(kRoot, {30, 40, 20});
  const Volume sharp = Scanned(truth);
  Volume scan = sharp;
  for (size_t v = 0; v < scan.values.size(); ++v) {  // the mean of 27 voxels
    const Eigen::Vector3i at = scan.grid.Ijk(v);
    double sum = 0;
    for (int n = 0; n < 27; ++n) {
      const Eigen::Vector3i q = (at + Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1))
                                    .cwiseMax(Eigen::Vector3i::Zero())
                                    .cwiseMin(scan.grid.size - Eigen::Vector3i::Ones());
      sum += sharp(q.x(), q.y(), q.z());
    }
    scan.values[v] = float(sum / 27);
  }
  ExpectRightOrFlagged(Finger().Register(scan), truth, 3);
}

TEST(RobustBones, ScaledIntensitiesAndAShadingAcrossTheScan) {
  const PoseVector truth = Bent(kRoot, {30, 40, 20});
  Volume scan = Scanned(truth);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3d part = scan.grid.Ijk(v).cast<double>().cwiseQuotient(scan.grid.size.cast<double>());
    scan.values[v] = float(scan.values[v] * (5 + 2 * part.x() - part.y()) + 300);
  }
  ExpectRightOrFlagged(Finger().Register(scan), truth, 4);
}

// Another sequence: tissues in other greys, by a falling curve and by one that rises and falls.
TEST(RobustBones, AnotherContrast) {
  const PoseVector truth = Bent(kRoot, {30, 40, 20});
  const Volume scan = Scanned(truth);
  for (const bool falling : {true, false}) {
    Volume other = scan;
    for (float& value : other.values)
      value = falling ? 250 - 1.3f * value : 200 - 0.02f * (value - 110) * (value - 110);
    ExpectRightOrFlagged(Finger().Register(other), truth, 3);
  }
}

// As converters write them that do not know a scan's voxel sizes.
TEST(RobustBones, AScanThatLostItsVoxelSizes) {
  const Grid& known = Finger().template_scan->volume.grid;
  Volume scan = Painted(Box({72, 66, 34}, known.spacing_mm, kOblique), kFinger, Bent(kRoot, {20, 25, 15}));
  scan.grid.spacing_mm.setConstant(0.4);
  for (const BoneFit& fit : Finger().Register(scan)) {
    EXPECT_EQ(fit.doubt, Doubt::kAnotherSize) << fit.note;
    EXPECT_NE(fit.note.find("1.2 x 1.2 x 1.3 mm"), std::string::npos) << fit.note;
  }
}

// Of the root the scan shows a rim only: the search goes on from the largest bone that it shows.
TEST(RobustBones, ARootOutsideTheView) {
  const PoseVector truth = Bent(kRoot, {10, 15, 10});
  Grid cut = Box({60, 60, 34}, {1.3, 1.3, 1.3}, Eigen::Matrix3d::Identity());
  cut.origin.lps.x() = -12;  // the palm ends at -9
  const BoneFits fits = Finger().Register(Painted(cut, kFinger, truth));
  EXPECT_TRUE(fits[0].Doubtful());
  for (const size_t b : {1, 2}) {
    EXPECT_LT(OffMm(fits[b], truth[b], b), 0.5 * kVoxelMm) << kFinger[b].name << ": " << fits[b].note;
    EXPECT_FALSE(fits[b].Doubtful()) << fits[b].note;
  }
}

// The root tells nothing of the other greys: another bone must.
TEST(RobustBones, ARootOutsideTheViewInAnotherContrast) {
  const EllipsoidWorld world(kHinge, Box({84, 44, 40}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity()));
  const RigidTransform tip = RotationAbout(PointMm{{-3, 0, 0}}, {0, 0, 1}, RadFromDeg(20));
  Grid cut = Box({46, 60, 44}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity());
  cut.origin.lps.x() = -10;  // the base ends at -1
  Volume scan = Painted(cut, kHinge, {{}, tip});
  for (float& value : scan.values) value = 260.0f - value;
  const BoneFits fits = world.Register(scan);
  EXPECT_TRUE(fits[0].Doubtful());
  EXPECT_LT(CentreMm(fits[1].scan_from_template, tip, PointMm{kHinge[1].centre_mm}), 0.5) << fits[1].note;
  EXPECT_FALSE(fits[1].Doubtful()) << fits[1].note;
}

TEST(RobustBones, ACroppedFingertipIsFlaggedAndTheOthersStayRight) {
  const PoseVector truth = Bent(RigidTransform{}, {5, 5, 5});
  Grid cut = Box({44, 44, 34}, {1.3, 1.3, 1.3}, Eigen::Matrix3d::Identity());
  cut.origin.lps.x() = -46;  // ends in the middle of "second"
  cut.size.x() = 46;         // at 12.5 mm
  const BoneFits fits = Finger().Register(Painted(cut, kFinger, truth));
  ExpectRightOrFlagged(fits, truth, 2);
  EXPECT_TRUE(fits[3].Doubtful());
}

// Without one it is taken to move with its parent, 20 degrees off.
TEST(RobustBones, ABoneOutOfViewLiesWhereItsInitialPoseHasIt) {
  const PoseVector truth = Bent(RigidTransform{}, {5, 5, 20});
  Grid cut = Box({44, 44, 34}, {1.3, 1.3, 1.3}, Eigen::Matrix3d::Identity());
  cut.origin.lps.x() = -46;
  cut.size.x() = 46;
  const BoneFits fits =
      Finger().Register(Painted(cut, kFinger, truth), {.initial_poses = {{"last", truth[3]}}});
  EXPECT_LT(OffMm(fits[3], truth[3], 3), 1e-6) << fits[3].note;
  EXPECT_TRUE(fits[3].Doubtful());
}

// Tissue would be torn by as much, and the build be busy with it for long. Here the limit is some 100 mm.
TEST(RobustBones, AnInitialPoseFarBeyondTheScanCountsForNothing) {
  const PoseVector truth = Bent(RigidTransform{}, {5, 5, 20});
  Grid cut = Box({44, 44, 34}, {1.3, 1.3, 1.3}, Eigen::Matrix3d::Identity());
  cut.origin.lps.x() = -46;
  cut.size.x() = 46;
  const Volume scan = Painted(cut, kFinger, truth);
  RigidTransform far = truth[3];
  far.translation_mm += Eigen::Vector3d(300, -200, 100);
  const BoneFits without = Finger().Register(scan),
                 with_hint = Finger().Register(scan, {.initial_poses = {{"last", far}}});
  for (size_t b = 0; b < without.size(); ++b) {
    EXPECT_EQ(OffMm(with_hint[b], without[b].scan_from_template, b), 0) << kFinger[b].name;
    EXPECT_EQ(with_hint[b].note, without[b].note);
  }
}

// A bone that left its joint is not looked for where it went: flagged without help, right with a rough
// initial pose.
TEST(RobustBones, AnInitialPoseRescuesABone) {
  const EllipsoidWorld world(kHinge, Box({84, 44, 40}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity()));
  const PointMm centre{kHinge[1].centre_mm};
  RigidTransform tip = RotationAbout(centre, {0, 0, 1}, RadFromDeg(20));
  tip.translation_mm += Eigen::Vector3d(8, 26, 0);
  const Volume scan =
      Painted(Box({100, 90, 44}, {1.0, 1.1, 1.2}, Eigen::Matrix3d::Identity()), kHinge, {{}, tip});
  const BoneFit alone = world.Register(scan).at(1);
  EXPECT_GT(CentreMm(alone.scan_from_template, tip, centre), 5);
  EXPECT_TRUE(alone.Doubtful());
  RigidTransform rough = RotationAbout(centre, {0.1, 0.05, 1}, RadFromDeg(14));
  rough.translation_mm += Eigen::Vector3d(6.5, 27, 1);
  const BoneFit helped = world.Register(scan, {.initial_poses = {{"tip", rough}}}).at(1);
  EXPECT_LT(AngleDeg(helped.scan_from_template, tip), 1.5);
  EXPECT_LT(CentreMm(helped.scan_from_template, tip, centre), 0.2);
}

}  // namespace
}  // namespace kvx
