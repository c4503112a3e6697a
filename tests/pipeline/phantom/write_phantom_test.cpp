// Whole phantoms, tiny: files, truth against transforms, the same bytes for the same seed, refusals.
#include "pipeline/phantom/write_phantom.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <Eigen/QR>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/errors.h"
#include "core/voxels/cubic_spline.h"
#include "pipeline/io/npz_file.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/fixtures.h"

namespace kvx::phantom {
namespace {

namespace fs = std::filesystem;
using V = Eigen::Vector3d;

PhantomSettings Tiny(uint64_t seed, int threads) {
  PhantomSettings settings;
  settings.seed = seed;
  settings.grid = {{32, 32, 18}, V(10, 10, 9)};
  settings.cell_mm = 14;
  settings.points = 2000;
  settings.poses = {"flex25"};
  settings.threads = threads;
  return settings;
}

std::string Bytes(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

// Written once for all tests that only read.
const fs::path& Knee() {
  static const testing_support::ScratchFolder scratch;
  static const fs::path folder = [] {
    WritePhantom(Tiny(4, 2), scratch.path() / "knee", {});
    return scratch.path() / "knee";
  }();
  return folder;
}

nlohmann::ordered_json ManifestOf(const fs::path& folder) {
  return nlohmann::ordered_json::parse(Bytes(folder / "manifest.json"));
}

TEST(WritePhantom, ScansLieOnTheGridOfTheManifest) {
  const Scan scan = ReadScan(Knee() / "pose01.nii.gz");
  EXPECT_EQ(scan.volume.grid, Tiny(4, 1).grid.World());
  EXPECT_EQ(scan.stored_as, ScalarType::kUint8);
  EXPECT_EQ(ReadLabels(Knee() / "bones_template.nii.gz").grid, scan.volume.grid);
  const auto affine = ManifestOf(Knee())["grid"]["affine"];
  EXPECT_DOUBLE_EQ(affine[0][3], -155);  // RAS: the corner with the smallest coordinates
  EXPECT_DOUBLE_EQ(scan.volume.grid.origin.lps.x(), 155);
}

TEST(WritePhantom, TheTemplateIsItsOwnTruth) {
  const NpyArrays truth = ReadNpz(Knee() / "truth" / "pose00_points.npz");
  EXPECT_EQ(ArrayNamed(truth, "template").bytes, ArrayNamed(truth, "position").bytes);
  EXPECT_EQ(ArrayNamed(truth, "template").shape, (std::vector<size_t>{2000, 3}));
}

TEST(WritePhantom, BonePointsMoveByTheirTransforms) {
  const NpyArrays truth = ReadNpz(Knee() / "truth" / "pose01_points.npz");
  const std::vector<double> from = AsDoubles(ArrayNamed(truth, "template")),
                            to = AsDoubles(ArrayNamed(truth, "position")),
                            bone = AsDoubles(ArrayNamed(truth, "bone"));
  const auto motions = ManifestOf(Knee())["poses"][1]["T"];
  int checked = 0;
  for (size_t p = 0; p < bone.size(); ++p) {
    if (bone[p] == 0) continue;
    const auto& t = motions[size_t(bone[p]) - 1];
    for (size_t r = 0; r < 3; ++r) {
      double x = t[r][3].get<double>();
      for (size_t c = 0; c < 3; ++c) x += t[r][c].get<double>() * from[3 * p + c];
      EXPECT_NEAR(to[3 * p + r], x, 1e-3);
    }
    ++checked;
  }
  EXPECT_GT(checked, 10);
}

V FromJson(const auto& numbers) { return V(numbers[0], numbers[1], numbers[2]); }

Eigen::Isometry3d FromRows(const auto& rows) {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) motion(r, c) = rows[size_t(r)][size_t(c)];
  return motion;
}

Eigen::Isometry3d About(const V& centre, const Eigen::Isometry3d& motion) {
  return Eigen::Translation3d(centre) * motion * Eigen::Translation3d(-centre);
}

// Joints turn the child about their axes, the first outermost, by its angles, and slop after them, all about
// the joint's centre.
TEST(WritePhantom, TransformsFollowFromAnglesSlopAndTheWholeBodysMotion) {
  const auto manifest = ManifestOf(Knee()), pose = manifest["poses"][1];
  std::vector<Eigen::Isometry3d> motions(manifest["bones"].size(), FromRows(pose["global_motion"]));
  ASSERT_EQ(pose["angles"].size(), manifest["joints"].size());
  for (const auto& joint : manifest["joints"]) {
    Eigen::Isometry3d& motion = motions[joint["child"].get<size_t>() - 1];
    motion = motions[joint["parent"].get<size_t>() - 1];
    const std::string name = joint["name"];
    for (const auto& [axis, direction] : joint["axes"].items()) {
      if (!pose["angles"][name].contains(axis)) continue;
      const Eigen::AngleAxisd turn(RadFromDeg(double(pose["angles"][name][axis])), FromJson(direction));
      motion = motion * About(FromJson(joint["cor"]), Eigen::Isometry3d(turn));
    }
    const V turn = RadFromDeg(1.0) * FromJson(pose["slop"][name]["rot_deg"]);
    const V shift = FromJson(pose["slop"][name]["shift_mm"]);
    EXPECT_GT(shift.norm(), 1e-3);
    const RigidTransform slop = Exp((Twist() << turn, shift).finished());
    motion = motion * About(FromJson(joint["cor"]), Eigen::Isometry3d(slop.Matrix()));
  }
  for (size_t b = 0; b < motions.size(); ++b)
    EXPECT_LT((motions[b].matrix() - FromRows(pose["T"][b]).matrix()).norm(), 1e-6) << b;
}

V RasFromLps(const V& x) { return {-x.x(), -x.y(), x.z()}; }

TEST(WritePhantom, LabelsSayWhatLiesAtTheirVoxelsCentres) {
  const LabelMap labels = ReadLabels(Knee() / "bones_template.nii.gz");
  const Anatomy knee = MakeKnee(4);
  int bone_voxels = 0;
  for (size_t v = 0; v < labels.values.size(); ++v) {
    const V x = RasFromLps(labels.grid.ToMm(PointVox{labels.grid.Ijk(v).cast<double>()}).lps);
    if (labels.values[v] == 0) {
      for (const PhantomBone& bone : knee.bones) {
        EXPECT_TRUE(bone.shape.Distance(x) > 0 || knee.body.Distance(x) > 0);
      }
      continue;
    }
    EXPECT_LE(knee.bones[labels.values[v] - 1u].shape.Distance(x), 0) << labels.values[v];
    ++bone_voxels;
  }
  EXPECT_GT(bone_voxels, 300);
}

// Rician: where there is no signal, the mean square is twice the variance.
TEST(WritePhantom, AirIsNoiseAsTheManifestSays) {
  const Volume scan = ReadScan(Knee() / "pose01.nii.gz").volume;
  double squares = 0, count = 0;
  for (int k = 0; k < scan.grid.size.z(); ++k)
    for (int j = 0; j < scan.grid.size.y(); ++j)
      for (const int i : {0, 1, 2}) squares += std::pow(scan(i, j, k), 2), ++count;
  const double sigma = ManifestOf(Knee())["noise_sigma"];
  EXPECT_NEAR(squares / count / (2 * sigma * sigma), 1, 0.1);
}

// Of a stored scan, at world places.
struct Greys {
  Grid grid;
  Volume spline;

  explicit Greys(const fs::path& file) {
    const Volume volume = ReadScan(file).volume;
    grid = volume.grid, spline = SplineCoefficients(volume);
  }
  double At(const V& ras) const { return SampleSpline(spline, grid.ToVox(PointMm{RasFromLps(ras)})); }
  V SlopeAt(const V& ras) const {
    V slope;
    for (int axis = 0; axis < 3; ++axis)
      slope[axis] = (At(ras + V::Unit(axis)) - At(ras - V::Unit(axis))) / 2;
    return slope;
  }
};

// By how many mm, all over, greys lie beside the points that they belong to: least squares of the scan's
// greys by the template's, times a smooth field, and by the scan's slopes.
V ShiftOfGreysMm(const fs::path& phantom) {
  const NpyArrays truth = ReadNpz(phantom / "truth" / "pose01_points.npz");
  const auto values = [&](const char* name) { return AsDoubles(ArrayNamed(truth, name)); };
  const std::vector<double> from = values("template"), to = values("position"), in_fov = values("in_fov"),
                            hidden = values("hidden");
  const Greys rest(phantom / "pose00.nii.gz"), bent(phantom / "pose01.nii.gz");
  Eigen::MatrixXd causes = Eigen::MatrixXd::Zero(Eigen::Index(in_fov.size()), 10);
  Eigen::VectorXd greys = Eigen::VectorXd::Zero(causes.rows());
  for (Eigen::Index p = 0; p < causes.rows(); ++p) {
    if (!in_fov[size_t(p)] || hidden[size_t(p)]) continue;
    const V x(&from[3 * size_t(p)]), y(&to[3 * size_t(p)]), far = y / 100;
    const V slope = bent.SlopeAt(y);
    greys[p] = bent.At(y);
    causes.row(p) << slope.transpose(), rest.At(x) * Eigen::RowVector4d(1, far.x(), far.y(), far.z()),
        rest.At(x) * far.cwiseProduct(far).transpose();
  }
  return causes.colPivHouseholderQr().solve(greys).head<3>();
}

TEST(WritePhantom, ScansShowTheGreysOfTheirTruthPoints) {
  const V shift = ShiftOfGreysMm(Knee());
  EXPECT_LT(shift.norm(), 0.4) << shift.transpose();  // of voxels of 10 mm
}

TEST(WritePhantom, StudyNamesTrainingScansOnly) {
  const auto study = nlohmann::json::parse(Bytes(Knee() / "study.json"));
  EXPECT_EQ(study["region"], "knee");
  EXPECT_EQ(study["scans"].size(), 2u);
  EXPECT_EQ(study["bones"]["list"][3]["parent"], "femur");
}

TEST(WritePhantom, SameSeedSameBytesWhateverTheThreads) {
  const testing_support::ScratchFolder scratch;
  WritePhantom(Tiny(4, 1), scratch.path() / "again", {});
  for (const char* file : {"pose00.nii.gz", "pose01.nii.gz", "bones_template.nii.gz", "manifest.json",
                           "truth/pose01_points.npz"}) {
    EXPECT_EQ(Bytes(Knee() / file), Bytes(scratch.path() / "again" / file)) << file;
  }
}

TEST(WritePhantom, AnotherSeedIsAnotherPerson) {
  const testing_support::ScratchFolder scratch;
  WritePhantom(Tiny(5, 0), scratch.path() / "other", {});
  EXPECT_NE(Bytes(Knee() / "bones_template.nii.gz"),
            Bytes(scratch.path() / "other" / "bones_template.nii.gz"));
  EXPECT_NE(Bytes(Knee() / "pose01.nii.gz"), Bytes(scratch.path() / "other" / "pose01.nii.gz"));
}

TEST(WritePhantom, RefusesAFolderWithFilesAndLeavesNothingBehindWhenStopped) {
  EXPECT_THROW(WritePhantom(Tiny(4, 1), Knee(), {}), InputError);
  const testing_support::ScratchFolder scratch;
  int reports = 0;
  const Progress stopped({}, [&] { return ++reports > 3; });
  EXPECT_THROW(WritePhantom(Tiny(4, 1), scratch.path() / "stopped", stopped), Cancelled);
  EXPECT_TRUE(fs::is_empty(scratch.path()));
}

// As a container's mount, whose parent may not be written and which nothing can be put in the place of.
TEST(WritePhantom, FillsAFolderThatIsThere) {
  const testing_support::ScratchFolder scratch;
  const fs::path folder = scratch.path() / "there";
  fs::create_directories(folder / ".partial" / "of a killed one");
  struct stat before {
  }, after{};
  ASSERT_EQ(::stat(folder.c_str(), &before), 0);
  WritePhantom(Tiny(4, 2), folder, {});
  ASSERT_EQ(::stat(folder.c_str(), &after), 0);
  EXPECT_EQ(after.st_ino, before.st_ino);
  EXPECT_FALSE(fs::exists(folder / ".partial"));
  for (const char* file : {"study.json", "pose01.nii.gz", "truth/pose01_points.npz"})
    EXPECT_EQ(Bytes(Knee() / file), Bytes(folder / file)) << file;
}

TEST(SettingsFor, HalvesTheVoxelsAndDoublesTheirSize) {
  const PhantomSettings half = SettingsFor({Region::kHand, 1, true});
  EXPECT_EQ(half.grid.size, Eigen::Vector3i(128, 128, 50));
  EXPECT_DOUBLE_EQ(half.grid.spacing_mm.x(), 1.5625);
  EXPECT_THROW(SettingsFor({Region::kCustom, 1, false}), InputError);
}

}  // namespace
}  // namespace kvx::phantom
