// Round trips through every format and type, on an oblique anisotropic grid; refusals that name the remedy.
#include "pipeline/io/volume_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/errors.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;
using testing::HasSubstr;

// Whole numbers from -40 to 200 that tell every axis from the others.
Volume WholeNumbers(const Grid& grid) {
  Volume out(grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v);
    out.values[v] = float(-40 + (p.x() + 19 * p.y() + 37 * p.z()) % 241);
  }
  return out;
}

void ExpectSamePlace(const Grid& a, const Grid& b) {
  EXPECT_EQ(a.size, b.size);
  EXPECT_TRUE(a.spacing_mm.isApprox(b.spacing_mm, 1e-6)) << a.spacing_mm.transpose();
  EXPECT_LT((a.origin.lps - b.origin.lps).norm(), 1e-5) << a.origin.lps.transpose();
  EXPECT_LT((a.direction - b.direction).norm(), 1e-6) << a.direction;
}

class VolumeFormats : public testing::TestWithParam<const char*> {};

TEST_P(VolumeFormats, VoxelsAndGeometryComeBack) {
  const ScratchFolder folder;
  const auto path = folder.path() / GetParam();
  const Volume written = WholeNumbers(ObliqueGrid());
  WriteVolume(path, written, ScalarType::kInt16);
  const Scan read = ReadScan(path);
  EXPECT_EQ(read.volume.values, written.values);
  EXPECT_EQ(read.stored_as, ScalarType::kInt16);
  ExpectSamePlace(read.volume.grid, written.grid);
  ExpectSamePlace(ReadVolumeInfo(path).grid, written.grid);
}

TEST_P(VolumeFormats, LeftHandedAxesComeBack) {
  const ScratchFolder folder;
  Grid grid = ObliqueGrid();
  grid.direction.col(2) *= -1;
  WriteVolume(folder.path() / GetParam(), WholeNumbers(grid), ScalarType::kFloat32);
  ExpectSamePlace(ReadScan(folder.path() / GetParam()).volume.grid, grid);
}

TEST_P(VolumeFormats, LabelsComeBackAndNothingIsLeftBeside) {
  const ScratchFolder folder;
  LabelMap labels(ObliqueGrid());
  for (size_t v = 0; v < labels.values.size(); ++v) labels.values[v] = uint16_t(v % 7 == 0 ? 60000 : v % 5);
  WriteLabels(folder.path() / GetParam(), labels);
  EXPECT_EQ(ReadLabels(folder.path() / GetParam()).values, labels.values);
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    EXPECT_EQ(entry.path().filename().string().find(".part"), std::string::npos)
        << "a temporary file was left";
  }
}

INSTANTIATE_TEST_SUITE_P(All, VolumeFormats,
                         testing::Values("v.nii", "v.nii.gz", "v.nrrd", "v.mha", "v.mhd", "V.NII.GZ"));

TEST(VolumeFile, WritingRoundsAndClampsToTheType) {
  const ScratchFolder folder;
  Grid grid;
  grid.size = {2, 2, 2};
  Volume volume(grid);
  volume.values = {-3, 0.4f, 0.6f, 254.4f, 255.5f, 1e9f, 17, 128};
  WriteVolume(folder.path() / "v.nii", volume, ScalarType::kUint8);
  EXPECT_THAT(ReadScan(folder.path() / "v.nii").volume.values,
              testing::ElementsAre(0, 0, 1, 254, 255, 255, 17, 128));
}

}  // namespace
}  // namespace kvx
