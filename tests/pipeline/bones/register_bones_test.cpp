// Planted rigid motions of textured bones, found again.
#include "pipeline/bones/register_bones.h"

#include <gtest/gtest.h>

#include "core/errors.h"
#include "pipeline/bones/bone_tree.h"
#include "pipeline/bones/build_bone_set.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// Ellipsoids with a dark shell and a marrow whose texture is fixed to the bone, in tissue with a slow texture
// of its own.
struct Ellipsoid {
  std::string name, parent;
  Eigen::Vector3d centre_mm, half_mm;
};

double Texture(const Eigen::Vector3d& x) {
  return std::sin(0.55 * x.x() + 0.3 * x.y()) + std::sin(0.6 * x.y() - 0.35 * x.z()) +
         std::sin(0.5 * x.z() + 0.4 * x.x() + 1);
}

// 0 well below the surface of the ellipsoid scaled by `part`, 1 well above, over about 2 mm: scanners do not
// alias.
double Beyond(const Ellipsoid& bone, const Eigen::Vector3d& x_in_template, double part) {
  const double r = (x_in_template - bone.centre_mm).cwiseQuotient(bone.half_mm).norm();
  return 1 / (1 + std::exp(-(r - part) * bone.half_mm.minCoeff() / 0.5));
}

Volume Painted(const Grid& grid, const std::vector<Ellipsoid>& bones, const PoseVector& pose,
               LabelMap* labels = nullptr) {
  Volume out(grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    const PointMm x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()});
    double value = 90 + 6 * std::sin(0.1 * x.lps.x() + 0.12 * x.lps.y());
    for (size_t b = 0; b < bones.size(); ++b) {
      const Eigen::Vector3d x_in_template = (pose[b].Inverse() * x).lps;
      const double outside = Beyond(bones[b], x_in_template, 1.0),
                   shell = Beyond(bones[b], x_in_template, 0.8);
      const double bone_value = 20 * shell + (150 + 20 * Texture(x_in_template)) * (1 - shell);
      value = value * outside + bone_value * (1 - outside);
      if (labels && outside < 0.5) labels->values[v] = uint16_t(b + 1);
    }
    out.values[v] = float(value);
  }
  return out;
}

Grid Box(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm, const Eigen::Matrix3d& direction) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = spacing_mm;
  grid.direction = direction;
  grid.origin.lps = -grid.MmFromVox() * (0.5 * (size.array() - 1).cast<double>().matrix());
  return grid;
}

struct World {
  std::vector<Ellipsoid> ellipsoids;
  Artifact<Scan> template_scan{{}, nullptr};
  Artifact<BoneSet> bones{{}, nullptr};

  World(std::vector<Ellipsoid> drawn, const Grid& grid) : ellipsoids(std::move(drawn)) {
    auto scan = std::make_shared<Scan>();
    auto set = std::make_shared<BoneSet>();
    set->labels = LabelMap(grid);
    scan->volume = Painted(grid, ellipsoids, PoseVector(ellipsoids.size()), &set->labels);
    std::vector<StudyBone> listed;
    for (const Ellipsoid& e : ellipsoids) listed.push_back({int(listed.size()) + 1, e.name, e.parent});
    set->bones = OrderedBones(listed);
    for (size_t b = 0; b < set->bones.size(); ++b) {
      Bone& bone = set->bones[b];
      for (const uint16_t value : set->labels.values) bone.voxels += value == bone.label;
      bone.centroid.lps = ellipsoids[b].centre_mm;
      bone.box =
          FitOrientedBox(set->labels, bone.label, PointMm{bone.centroid.lps - 50 * Eigen::Vector3d::UnitX()});
    }
    template_scan.value = scan;
    bones.value = set;
  }

  BoneFits Register(const Volume& volume, const RegisterBones::Options& options = {}) const {
    auto scan = std::make_shared<Scan>();
    scan->volume = volume;
    const Artifact<Scan> target{{}, scan};
    StageContext context{SharedBackend(), {}};
    return RegisterBones::Run({template_scan, bones, target}, options, context);
  }
};

double AngleDeg(const RigidTransform& a, const RigidTransform& b) {
  return DegFromRad((a.Inverse() * b).AngleRad());
}
double CentreMm(const RigidTransform& a, const RigidTransform& b, const PointMm& x) {
  return ((a * x).lps - (b * x).lps).norm();
}

const Eigen::Matrix3d kOblique =
    Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
const std::vector<Ellipsoid> kOneBone{{"bone", "", {2, -1, 1}, {17, 9, 7}}};
const std::vector<Ellipsoid> kHinge{{"base", "", {-19, 0, 0}, {18, 8, 7}},
                                    {"tip", "base", {17, 0, 0}, {16, 7, 6}}};

World OneBone() { return World(kOneBone, Box({56, 44, 34}, {1.0, 1.2, 1.5}, kOblique)); }

TEST(RegisterBones, APlantedMotionOnObliqueAnisotropicGrids) {
  const World world = OneBone();
  const RigidTransform truth = Exp((Twist() << 0.25, -0.3, 0.2, 5.0, -4.0, 3.0).finished());
  const Grid grid = Box({60, 52, 46}, {1.1, 1.0, 1.3}, kOblique.transpose());
  const BoneFit fit = world.Register(Painted(grid, kOneBone, {truth})).at(0);
  EXPECT_LT(AngleDeg(fit.scan_from_template, truth), 0.5);
  EXPECT_LT(CentreMm(fit.scan_from_template, truth, PointMm{kOneBone[0].centre_mm}), 0.1);
  EXPECT_GT(fit.correlation, 0.9);
  EXPECT_FALSE(fit.doubtful) << fit.note;
}

TEST(RegisterBones, GainAndBiasOfTheScannerDoNotMatter) {
  const World world = OneBone();
  const RigidTransform truth = Exp((Twist() << -0.2, 0.1, 0.15, -3.0, 2.0, 1.0).finished());
  Volume scan = Painted(Box({56, 50, 44}, {1.1, 1.1, 1.1}, Eigen::Matrix3d::Identity()), kOneBone, {truth});
  const BoneFit plain = world.Register(scan).at(0);
  for (float& value : scan.values) value = 0.3f * value - 700.0f;
  const BoneFit scaled = world.Register(scan).at(0);
  EXPECT_LT(AngleDeg(plain.scan_from_template, scaled.scan_from_template), 0.02);
  EXPECT_LT(CentreMm(plain.scan_from_template, scaled.scan_from_template, PointMm{kOneBone[0].centre_mm}),
            0.01);
  EXPECT_NEAR(plain.correlation, scaled.correlation, 1e-3);
}

TEST(RegisterBones, AHingeBentBySixtyDegreesWithoutHints) {
  const World world(kHinge, Box({84, 44, 40}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity()));
  const RigidTransform root = Exp((Twist() << 0.1, 0.2, -0.3, 2.0, 6.0, -4.0).finished());
  const PoseVector truth{root, root * RotationAbout(PointMm{{-3, 0, 0}}, {0, 0, 1}, RadFromDeg(60))};
  const Volume scan = Painted(Box({96, 72, 44}, {1.0, 1.1, 1.2}, Eigen::Matrix3d::Identity()), kHinge, truth);
  const BoneFits fits = world.Register(scan);
  for (size_t b = 0; b < 2; ++b) {
    EXPECT_LT(AngleDeg(fits[b].scan_from_template, truth[b]), 1.0)
        << kHinge[b].name;  // nearly round: twist is weak
    EXPECT_LT(CentreMm(fits[b].scan_from_template, truth[b], PointMm{kHinge[b].centre_mm}), 0.15)
        << kHinge[b].name;
    EXPECT_FALSE(fits[b].doubtful) << fits[b].note;
  }
  const BoneFits again = world.Register(scan);
  for (size_t b = 0; b < 2; ++b) {
    EXPECT_EQ(RowMajor(fits[b].scan_from_template), RowMajor(again[b].scan_from_template))
        << "not deterministic";
  }
}

TEST(RegisterBones, ABoneOutsideTheViewFollowsItsParentAndIsFlagged) {
  const World world(kHinge, Box({84, 44, 40}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity()));
  Grid cut = Box({46, 52, 44}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity());
  cut.origin.lps.x() = -44;  // ends where the tip begins
  const BoneFits fits = world.Register(Painted(cut, kHinge, PoseVector(2)));
  EXPECT_FALSE(fits[0].doubtful) << fits[0].note;
  EXPECT_TRUE(fits[1].doubtful);
  EXPECT_NE(fits[1].note.find("'tip'"), std::string::npos);
  EXPECT_EQ(RowMajor(fits[0].scan_from_template), RowMajor(fits[1].scan_from_template));
}

TEST(RegisterBones, NoiseAloneIsNeverTakenForABone) {
  const World world = OneBone();
  Volume noise(Box({50, 44, 40}, {1.1, 1.1, 1.2}, Eigen::Matrix3d::Identity()));
  uint32_t state = 1;
  for (float& value : noise.values)
    value = float((state = state * 1664525u + 1013904223u) >> 8) / float(1 << 24);
  EXPECT_TRUE(world.Register(noise).at(0).doubtful);
}

TEST(RegisterBones, RefusesAHintForAnUnknownBone) {
  const World world = OneBone();
  EXPECT_THROW(world.Register(world.template_scan->volume, {.initial_poses = {{"nose", {}}}}), NotFound);
}

// The generator's truth, not an earlier result of ours.
TEST(RegisterBones, TheKneePhantomAtFiftyDegrees) {
  if (!HasSharedData()) GTEST_SKIP() << "the shared data is not here";
  const auto folder = SharedData() / "phantom/knee-dev-half";
  World world = OneBone();
  world.template_scan.value = std::make_shared<Scan>(ReadScan(folder / "pose00.nii.gz"));
  StageContext context{SharedBackend(), {}};
  const BuildBoneSet::Inputs inputs{world.template_scan, {}, folder / "bones_template.nii.gz"};
  world.bones.value =
      std::make_shared<BoneSet>(BuildBoneSet::Run(inputs, {.region = Region::kKnee}, context));
  const BoneFits fits = world.Register(ReadScan(folder / "pose02.nii.gz").volume);
  // scan_from_template of femur, tibia, fibula, patella, LPS mm
  const std::array<std::array<double, 16>, 4> kKneeTruth{{
      {0.98378576, -0.177998444, 0.0219575029, -5.07561165, 0.178742841, 0.983138352, -0.0386002371,
       4.55948378, -0.014716481, 0.04189911, 0.999013458, 0.820642583, -0, -0, 0, 1},
      {0.790392644, 0.61225226, 0.0206552565, -7.00896158, -0.610069349, 0.789741171, -0.0642204924,
       -2.44132131, -0.055631448, 0.0381582658, 0.99772195, 0.750142969, -0, -0, 0, 1},
      {0.783303716, 0.621345021, 0.0191220856, -7.37568255, -0.619550878, 0.782822151, -0.0578462585,
       -2.45742853, -0.0509116769, 0.0334640843, 0.998142353, 1.06095082, -0, -0, 0, 1},
      {0.856443436, 0.516185643, 0.00755138342, -5.44741782, -0.515481957, 0.855885763, -0.0416882867,
       -8.33413646, -0.0279820166, 0.0318110576, 0.999102129, 0.561107489, -0, -0, 0, 1},
  }};
  for (int b = 0; b < 4; ++b) {
    const RigidTransform truth = RigidFromRowMajor(kKneeTruth[b]);
    const std::string& name = world.bones->bones[b].name;
    EXPECT_LT(AngleDeg(fits[b].scan_from_template, truth), 2.0) << name;
    EXPECT_LT(CentreMm(fits[b].scan_from_template, truth, world.bones->bones[b].centroid), 0.3 * 2.44)
        << name;
    EXPECT_FALSE(fits[b].doubtful) << fits[b].note;
  }
}

}  // namespace
}  // namespace kvx
