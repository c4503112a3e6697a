// Whole phantoms, tiny: files, truth against transforms, the same bytes for the same seed, refusals.
#include "pipeline/phantom/write_phantom.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/errors.h"
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
  settings.points = 300;
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

nlohmann::json ManifestOf(const fs::path& folder) {
  return nlohmann::json::parse(Bytes(folder / "manifest.json"));
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
  EXPECT_EQ(ArrayNamed(truth, "template").shape, (std::vector<size_t>{300, 3}));
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

TEST(SettingsFor, HalvesTheVoxelsAndDoublesTheirSize) {
  const PhantomSettings half = SettingsFor({Region::kHand, 1, true});
  EXPECT_EQ(half.grid.size, Eigen::Vector3i(128, 128, 50));
  EXPECT_DOUBLE_EQ(half.grid.spacing_mm.x(), 1.5625);
  EXPECT_THROW(SettingsFor({Region::kCustom, 1, false}), InputError);
}

}  // namespace
}  // namespace kvx::phantom
