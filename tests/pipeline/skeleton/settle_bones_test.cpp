// Poses drawn from a known joint with known errors:
// what all scans share must help where one scan is weak, and only there.
#include "pipeline/skeleton/settle_bones.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "pipeline/skeleton/joint_model.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

const Eigen::Vector3d kHingeAxis = Eigen::Vector3d::UnitZ();

// Two rods along x that meet near the origin.
BoneSet TwoRods() {
  Grid grid;
  grid.size = {60, 16, 16};
  grid.origin.lps = {-29.5, -7.5, -7.5};
  BoneSet set;
  set.labels = LabelMap(grid);
  for (size_t v = 0; v < set.labels.values.size(); ++v) {
    const Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    if (x.tail<2>().norm() < 4 && std::abs(x.x()) > 1.2) set.labels.values[v] = x.x() < 0 ? 1 : 2;
  }
  set.bones = {{.label = 1, .name = "base", .voxels = 1400, .centroid = PointMm{{-15, 0, 0}}},
               {.label = 2, .name = "tip", .parent = 0, .voxels = 1400, .centroid = PointMm{{15, 0, 0}}}};
  for (Bone& bone : set.bones) bone.box = {bone.centroid, Eigen::Matrix3d::Identity(), {28, 8, 8}};
  return set;
}

struct Drawn {
  std::vector<PoseVector> truth;
  std::vector<Artifact<BoneFits>> fits;
};

// Eight scans of a hinge that has `play_deg` about the bones' length; the tip's turn about its long axis is
// measured with an error of `twist_deg`, all else well.
Drawn Draw(double twist_deg, double play_deg = 0.4, unsigned seed = 7) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  Drawn out;
  for (int k = 0; k < 8; ++k) {
    const RigidTransform root = Exp((Twist() << 0.1 * k, 0.2, -0.1, 2.0, k, -2.0).finished());
    const RigidTransform slop = RotationAbout(PointMm{}, {1, 0, 0}, RadFromDeg(play_deg) * normal(random));
    const RigidTransform tip = root * RotationAbout(PointMm{}, kHingeAxis, RadFromDeg(8.0 * k)) * slop;
    const double error_rad = RadFromDeg(twist_deg) * normal(random);
    BoneFits fits(2);
    fits[0].scan_from_template = root;
    fits[1].scan_from_template = tip * RotationAbout(PointMm{{15, 0, 0}}, {1, 0, 0}, error_rad);
    for (BoneFit& fit : fits) {
      fit.covariance.diagonal() << 1e-6, 1e-6, 1e-6, 1e-4, 1e-4, 1e-4;
    }
    fits[1].covariance(0, 0) = std::pow(RadFromDeg(twist_deg), 2) + 1e-6;
    out.truth.push_back({root, tip});
    out.fits.push_back({{}, std::make_shared<BoneFits>(fits)});
  }
  return out;
}

const SettleBones::Options kHingeOptions{Region::kCustom, {{"tip", {"flexion"}}}};

std::vector<BoneFits> Settle(const std::vector<Artifact<BoneFits>>& fits) {
  const Artifact<BoneSet> bones{{}, std::make_shared<BoneSet>(TwoRods())};
  StageContext context{SharedBackend(), {}};
  return SettleBones::Run({bones, fits}, kHingeOptions, context);
}

double ErrorDeg(const RigidTransform& a, const RigidTransform& b) {
  return DegFromRad((a.Inverse() * b).AngleRad());
}

TEST(SettleBones, TheOtherScansHoldAWeakTwist) {
  const Drawn drawn = Draw(5);
  double before = 0, after = 0, said = 0;
  const std::vector<BoneFits> all = Settle(drawn.fits);
  for (int k = 0; k < 8; ++k) {
    const BoneFits& settled = all[k];
    before += std::pow(ErrorDeg((*drawn.fits[k])[1].scan_from_template, drawn.truth[k][1]), 2);
    after += std::pow(ErrorDeg(settled[1].scan_from_template, drawn.truth[k][1]), 2);
    said += std::pow(DegFromRad(1), 2) * settled[1].covariance(0, 0);
    EXPECT_LT(ErrorDeg(settled[0].scan_from_template, drawn.truth[k][0]), 0.1);
    EXPECT_FALSE(settled[1].Doubtful()) << settled[1].note;
  }
  EXPECT_LT(std::sqrt(after), 0.5 * std::sqrt(before));
  EXPECT_LT(after, 6 * said) << "surer than it may be";
}

// Of a few scans the axis is known about as badly as the twist that it decides. The play is what is taken for
// granted.
TEST(SettleBones, StatedErrorsHoldWhatTheAxisLeavesOpen) {
  constexpr int kSeeds = 60, kScans = 4;
  double squares = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Drawn drawn = Draw(3, 2, unsigned(seed));
    drawn.fits.erase(drawn.fits.begin(), drawn.fits.begin() + 4);
    const std::vector<BoneFits> all = Settle(drawn.fits);
    for (size_t k = 0; k < kScans; ++k) {
      const RigidTransform off = drawn.truth[k + 4][1].Inverse() * all[k][1].scan_from_template;
      squares += std::pow(RotationVector(off.rotation).x(), 2) / all[k][1].covariance(0, 0);
    }
  }
  EXPECT_NEAR(squares / (kSeeds * kScans), 1, 0.2);
}

TEST(SettleBones, WhatIsKnownWellStays) {
  const Drawn drawn = Draw(0);
  const std::vector<BoneFits> settled = Settle(drawn.fits);
  for (int k = 0; k < 8; ++k) {
    EXPECT_LT(ErrorDeg(settled[k][1].scan_from_template, drawn.truth[k][1]), 0.1);
  }
}

TEST(SettleBones, AScanThatDisagreesWithAllOthersIsNamed) {
  Drawn drawn = Draw(0.2);
  BoneFits odd = *drawn.fits[3];
  odd[1].scan_from_template =
      odd[1].scan_from_template * RotationAbout(PointMm{{15, 0, 0}}, {1, 0, 0}, RadFromDeg(35));
  drawn.fits[3].value = std::make_shared<BoneFits>(odd);
  const std::vector<BoneFits> settled = Settle(drawn.fits);
  for (int k = 0; k < 8; ++k) {
    const BoneFit& tip = settled[k][1];
    EXPECT_EQ(tip.Doubtful(), k == 3) << "scan " << k << ": " << tip.note;
  }
  EXPECT_NE(settled[3][1].note.find("stands to 'base'"), std::string::npos);
}

TEST(SettleBones, TwoScansSayNothingAboutAJoint) {
  Drawn drawn = Draw(5);
  drawn.fits.resize(2);
  const BoneFits settled = Settle(drawn.fits)[1];
  EXPECT_LT(ErrorDeg(settled[1].scan_from_template, (*drawn.fits[1])[1].scan_from_template), 1e-6);
}

TEST(SettleBones, ATurnThatMayBeADegreeOffIsNamedAndStillCounts) {
  Drawn drawn = Draw(1);
  drawn.fits.resize(2);  // no other scan holds it
  const BoneFits settled = Settle(drawn.fits)[1];
  EXPECT_NE(settled[1].note.find("turned"), std::string::npos);
  EXPECT_FALSE(settled[1].Doubtful());
  EXPECT_EQ(settled[0].note, "") << "it is known well";
  EXPECT_EQ(Settle(Draw(0.2).fits)[1][1].note, "");
}

TEST(SettleBones, ASmallBoneIsNamedByHowFarItsSurfaceMayLieOff) {
  Drawn drawn = Draw(1);
  drawn.fits.resize(2);
  BoneSet small = TwoRods();
  small.bones[1].voxels = 200;
  const auto note = [&](double half_width_mm) {
    small.bones[1].box.extent_mm = {28, 2 * half_width_mm, 2 * half_width_mm};
    const Artifact<BoneSet> bones{{}, std::make_shared<BoneSet>(small)};
    StageContext context{SharedBackend(), {}};
    return SettleBones::Run({bones, drawn.fits}, kHingeOptions, context)[1][1].note;
  };
  // 1.645 standard deviations of 1 degree at a lever of r mm: half a voxel of 1 mm is r = 17.4
  EXPECT_EQ(note(16).find("look before"), std::string::npos) << note(16);
  EXPECT_NE(note(19).find("surface up to 0.7 mm"), std::string::npos) << note(19);
  EXPECT_NE(note(19).find("look before"), std::string::npos) << note(19);
  // Its turn is known to 1 degree: the surface of a thin one stays within half a voxel, but sure it is not.
  EXPECT_NE(note(9).find("turned by up to 2.0 degrees"), std::string::npos) << note(9);
  EXPECT_NE(note(10).find("surface up to 0.4 mm"), std::string::npos) << note(10);
}

TEST(SettleBones, ABoneWhosePlaceIsPoorlyKnownIsNamed) {
  Drawn drawn = Draw(0.1);
  BoneFits loose = *drawn.fits[0];
  loose[1].covariance.diagonal().tail<3>().setConstant(0.04);  // 0.35 mm in all
  drawn.fits = {{{}, std::make_shared<BoneFits>(loose)}};
  EXPECT_NE(Settle(drawn.fits)[0][1].note.find("surface up to 0.7 mm"), std::string::npos);
}

TEST(SettleBones, ADoubtfulBoneStaysAsItIs) {
  Drawn drawn = Draw(5);
  BoneFits doubtful = *drawn.fits[2];
  doubtful[1].doubt = Doubt::kBone;
  drawn.fits[2].value = std::make_shared<BoneFits>(doubtful);
  EXPECT_EQ(RowMajor(Settle(drawn.fits)[2][1].scan_from_template), RowMajor(doubtful[1].scan_from_template));
}

// What the scan itself states is no reason to doubt the joint: 35 degrees where it says give or take 30.
TEST(SettleBones, AnErrorThatIsStatedIsNotOdd) {
  Drawn drawn = Draw(0.2);
  BoneFits loose = *drawn.fits[3];
  loose[1].scan_from_template =
      loose[1].scan_from_template * RotationAbout(PointMm{{15, 0, 0}}, {1, 0, 0}, RadFromDeg(35));
  loose[1].covariance(0, 0) = std::pow(RadFromDeg(30), 2);
  drawn.fits[3].value = std::make_shared<BoneFits>(loose);
  EXPECT_EQ(Settle(drawn.fits)[3][1].note.find("stands to"), std::string::npos);
}

class Settled : public testing::Test {
 protected:
  SettledPoses Of(const std::vector<BoneFits>& scans, const std::vector<std::string>& dofs) {
    for (const BoneFits& scan : scans) measured_.push_back(&scan);
    plans_ = {{}, {.dofs = dofs}};
    return SettledPoses(bones_, plans_, measured_);
  }

  BoneSet bones_ = TwoRods();
  std::vector<JointPlan> plans_;
  std::vector<const BoneFits*> measured_;
};

BoneFit Measured(const RigidTransform& scan_from_template, double sd_deg, double sd_mm) {
  BoneFit fit{.scan_from_template = scan_from_template};
  fit.covariance.diagonal().head<3>().setConstant(std::pow(RadFromDeg(sd_deg), 2));
  fit.covariance.diagonal().tail<3>().setConstant(sd_mm * sd_mm);
  return fit;
}

// Of a joint that does not stray at all only what is taken for granted remains: 2 degrees and 1 mm, worth six
// observations here and six drawn towards the mean of all joints, m. Four scans of a hinge are n = 4 * 2
// turns across it. Its axis takes up two of them, which are worth what is expected of any, scan by scan as
// far as it turns and as much as it is trusted: m^2 = (6 * 2^2 + c s^2) / (6 + n) and s^2 = (6 m^2 + c s^2) /
// (6 + n). They are n = 4 * 3 shifts less the 3 of its centre: m^2 = 6 / (6 + n) and s^2 = 6 m^2 / (6 + n).
TEST_F(Settled, WhatTheFitHasUsedUpIsNoObservation) {
  std::vector<BoneFits> scans;
  std::vector<double> far;  // how far a tilt of the axis takes a scan, squared
  for (int k = 0; k < 4; ++k) {
    const RigidTransform turn = RotationAbout(PointMm{}, kHingeAxis, RadFromDeg(20.0 * k));
    scans.push_back({Measured({}, 1e-3, 1e-3), Measured(turn, 1e-3, 1e-3)});
    far.push_back(2 - 2 * std::cos(RadFromDeg(20.0 * k)));
  }
  double c = 0;
  for (const double square : far) {
    const double odd = 2 * square / std::accumulate(far.begin(), far.end(), 0.0);
    c += (4 + 2 + 3) / (4 + odd) * odd;  // Student's t of four degrees
  }
  const double n = 8, part = 6 / (6 + n - c), m_squared = 6 * 2 * 2 / (6 + n - c * part);
  const JointModel joint = Of(scans, {"flexion"}).joints()[1];
  EXPECT_NEAR(DegFromRad(joint.stray_rad), std::sqrt(part * m_squared), 0.02);
  EXPECT_NEAR(joint.stray_mm, 6.0 / (6 + 9), 0.01);
}

// Scans that show nothing leave what is taken for granted.
TEST_F(Settled, WeakScansDoNotMakeAJointStrayFarther) {
  std::vector<BoneFits> scans;
  for (int k = 0; k < 5; ++k) {
    const RigidTransform turn = RotationAbout(PointMm{}, kHingeAxis, RadFromDeg(15.0 * k));
    scans.push_back({Measured({}, 0.1, 0.02), Measured(turn, 20, 0.02)});
  }
  EXPECT_NEAR(DegFromRad(Of(scans, {"flexion"}).joints()[1].stray_rad), 2, 0.4);
}

// A middle bone's twist is seen badly, but it hardly moves against the last bone, which is seen well: the
// hinge at its other end is known by that.
TEST_F(Settled, AnAxisIsFittedToWhatOtherJointsSayOfItsBones) {
  bones_.bones.push_back(
      {.label = 3, .name = "end", .parent = 1, .voxels = 1400, .centroid = PointMm{{45, 0, 0}}});
  bones_.bones.back().box = {bones_.bones.back().centroid, Eigen::Matrix3d::Identity(), {28, 8, 8}};
  plans_ = {{}, {.dofs = {"flexion"}}, {}};
  constexpr int kSeeds = 20;
  double squares = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    std::mt19937 random{unsigned(seed)};
    std::normal_distribution<double> normal(0, 1);
    std::vector<BoneFits> scans;
    measured_.clear();
    for (int k = 0; k < 4; ++k) {
      const RigidTransform turn = RotationAbout(PointMm{}, kHingeAxis, RadFromDeg(15.0 * k));
      const RigidTransform twist = RotationAbout(PointMm{}, {1, 0, 0}, RadFromDeg(15) * normal(random));
      scans.push_back(
          {Measured({}, 0.1, 0.05), Measured(turn * twist, 0.1, 0.05), Measured(turn, 0.1, 0.05)});
      scans.back()[1].covariance(0, 0) = std::pow(RadFromDeg(15), 2);
    }
    for (const BoneFits& scan : scans) measured_.push_back(&scan);
    const SettledPoses settled(bones_, plans_, measured_);
    squares += std::pow(settled.joints()[1].axes[0].x(), 2);
  }
  EXPECT_LT(DegFromRad(std::sqrt(squares / kSeeds)), 0.1);
}

// A scan that strays far from what the others show keeps its own pose, of which it is as sure as the joint
// is.
TEST_F(Settled, AScanThatStraysFarIsNotPulled) {
  const RigidTransform rogue = RotationAbout(PointMm{{15, 0, 0}}, {1, 0, 0}, RadFromDeg(40));
  std::vector<BoneFits> scans;
  for (int k = 0; k < 8; ++k) {
    const RigidTransform turn = RotationAbout(PointMm{}, kHingeAxis, RadFromDeg(10.0 * k));
    scans.push_back({Measured({}, 0.1, 0.02), Measured(k == 3 ? turn * rogue : turn, 2, 0.02)});
  }
  const SettledPoses settled = Of(scans, {"flexion"});
  EXPECT_LT(ErrorDeg(settled.Scan(3)[1].scan_from_template, scans[3][1].scan_from_template), 4);
}

// A joint that turns freely is a place that two bones share: it says the same whichever of them is the
// parent.
TEST_F(Settled, AJointThatTurnsFreelySettlesBothBonesAlike) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal(0, 1);
  const auto drawn = [&](double sd) {
    return Eigen::Vector3d(sd * normal(random), sd * normal(random), sd * normal(random));
  };
  std::vector<BoneFits> scans, swapped;
  for (int k = 0; k < 5; ++k) {
    const Eigen::Vector3d axis = drawn(1).normalized();
    RigidTransform tip = RotationAbout(PointMm{}, axis, RadFromDeg(20 + 10 * k));
    tip.translation_mm += drawn(1.5);
    scans.push_back({Measured({}, 3, 0.3), Measured(tip, 1, 0.1)});
    swapped.push_back({scans.back()[1], scans.back()[0]});
  }
  const std::vector<std::string> free = {"flexion", "abduction", "rotation"};
  const SettledPoses one_way = Of(scans, free);
  BoneSet reversed = TwoRods();
  std::swap(reversed.bones[0], reversed.bones[1]);
  reversed.bones[0].parent = kNoParent, reversed.bones[1].parent = 0;
  std::vector<const BoneFits*> measured;
  for (const BoneFits& scan : swapped) measured.push_back(&scan);
  const SettledPoses other_way(reversed, plans_, measured);
  for (size_t k = 0; k < scans.size(); ++k) {
    for (size_t b = 0; b < 2; ++b) {
      const RigidTransform &a = one_way.Scan(k)[b].scan_from_template,
                           &c = other_way.Scan(k)[1 - b].scan_from_template;
      EXPECT_GT(ErrorDeg(a, scans[k][b].scan_from_template), 0.05) << "it is settled";
      EXPECT_LT(ErrorDeg(a, c), 0.02) << "scan " << k << " bone " << b;
      const PointMm centroid = bones_.bones[b].centroid;
      EXPECT_LT(((a * centroid).lps - (c * centroid).lps).norm(), 0.01) << "scan " << k << " bone " << b;
    }
  }
}

}  // namespace
}  // namespace kvx
