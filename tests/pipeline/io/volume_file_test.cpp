// Round trips through every format and type, on an oblique anisotropic grid; refusals that name the remedy.
#include "pipeline/io/volume_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>

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

TEST(WriteVolume, ALengthThatNiftiDoesNotHoldIsRefusedWithWhatToDo) {
  const ScratchFolder folder;
  Grid grid;
  grid.size = {40000, 1, 1};
  EXPECT_THAT([&] { WriteVolume(folder.path() / "a.nii.gz", Volume(grid), ScalarType::kUint8); },
              testing::ThrowsMessage<InputError>(HasSubstr("choose .nrrd")));
  EXPECT_NO_THROW(WriteVolume(folder.path() / "a.nrrd", Volume(grid), ScalarType::kUint8));
}

// One volume, its world told in three ways: x to the right or left, y to the front or back.
TEST(ReadNrrd, EverySpaceIsTheSamePlace) {
  const ScratchFolder folder;
  const auto written = [&](const std::string& space, double x, double y) {
    std::ofstream out(folder.path() / "a.nrrd", std::ios::binary);
    const auto axis = [&](double a, double b, double c) {
      return " (" + std::to_string(x * a) + "," + std::to_string(y * b) + "," + std::to_string(c) + ")";
    };
    out << "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nspace: " << space
        << "\nspace directions:" << axis(2, 0.5, 0) << axis(-0.5, 2, 0) << axis(0, 0, 3)
        << "\nspace origin:" << axis(10, 20, 30) << "\n\n12345678";
    out.close();
    return ReadScan(folder.path() / "a.nrrd").volume.grid;
  };
  const Grid lps = written("left-posterior-superior", 1, 1);
  EXPECT_LT((lps.origin.lps - Eigen::Vector3d(10, 20, 30)).norm(), 1e-9);
  ExpectSamePlace(written("right-anterior-superior", -1, -1), lps);
  for (const char* las : {"left-anterior-superior", "left anterior superior", "LeftAnteriorSuperior", "LAS"})
    ExpectSamePlace(written(las, 1, -1), lps);
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

// As 3D Slicer writes a segmentation of three segments in two layers: `voxels` holds both values of a voxel
// side by side.
std::filesystem::path WriteLayers(const std::filesystem::path& path, const Grid& grid,
                                  const std::vector<uint8_t>& voxels, const std::string& last_layer = "1") {
  std::ofstream out(path, std::ios::binary);
  out << "NRRD0004\ntype: unsigned char\ndimension: 4\nspace: left-posterior-superior\nsizes: 2 "
      << grid.size.x() << " " << grid.size.y() << " " << grid.size.z() << "\nspace directions: none";
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector3d along = grid.direction.col(a) * grid.spacing_mm[a];
    out << " (" << along.x() << "," << along.y() << "," << along.z() << ")";
  }
  out << "\nkinds: list domain domain domain\nencoding: raw\nspace origin: (" << grid.origin.lps.x() << ","
      << grid.origin.lps.y() << "," << grid.origin.lps.z() << ")\n"
      << "Segment0_Layer:=0\nSegment0_LabelValue:=1\nSegment0_Name:=one\n"
      << "Segment1_LabelValue:=5\nSegment1_Layer:=0\n"
      << "Segment2_Layer:=" << last_layer << "\nSegment2_LabelValue:=1\n\n";
  out.write(reinterpret_cast<const char*>(voxels.data()), std::streamsize(voxels.size()));
  return path;
}

TEST(VolumeFile, SegmentsInLayersAreNumberedInTheirOrder) {
  const ScratchFolder folder;
  Grid grid;
  grid.size = {3, 2, 2};
  grid.spacing_mm = {0.5, 1, 2};
  grid.origin.lps = {3, -4, 5};
  const std::vector<std::array<uint8_t, 2>> voxels{{0, 0}, {1, 0}, {5, 0}, {0, 1}, {1, 1}, {5, 1},
                                                   {7, 0}, {0, 5}, {0, 0}, {0, 0}, {0, 0}, {0, 1}};
  std::vector<uint8_t> bytes;
  for (const auto& voxel : voxels) bytes.insert(bytes.end(), voxel.begin(), voxel.end());
  const auto path = WriteLayers(folder.path() / "bones.seg.nrrd", grid, bytes);
  const LabelMap labels = ReadLabels(path);
  ExpectSamePlace(labels.grid, grid);
  ExpectSamePlace(ReadLabelsGrid(path), grid);
  // Overlapping: the first one's. Values that no segment has are none's.
  EXPECT_THAT(labels.values, testing::ElementsAre(0, 1, 2, 3, 1, 2, 0, 0, 0, 0, 0, 3));
  EXPECT_THROW(ReadScan(path), InputError) << "it is no scan";
  for (const char* layer : {"2", "-1", "x", ""})
    EXPECT_THROW(ReadLabels(WriteLayers(folder.path() / "bad.nrrd", grid, bytes, layer)), InputError)
        << layer;
}

// As 3D Slicer wrote them before its version 4.11.
TEST(VolumeFile, SegmentsWithoutLabelValuesHaveALayerEach) {
  const ScratchFolder folder;
  std::ofstream(folder.path() / "bones.seg.nrrd", std::ios::binary)
      << "NRRD0004\ntype: unsigned char\ndimension: 4\nsizes: 2 2 2 2\nspacings: nan 1 1 1\nencoding: raw\n"
      << "kinds: list domain domain domain\nSegment0_ID:=Segment_1\nSegment0_Name:=femur\n"
      << "Segment1_ID:=Segment_2\nSegment1_Extent:=0 1 0 1 0 1\n\n"
      << std::string("\0\0\1\0\0\1\1\1\0\0\1\0\0\1\0\1", 16);
  EXPECT_THAT(ReadLabels(folder.path() / "bones.seg.nrrd").values,
              testing::ElementsAre(0, 1, 2, 1, 0, 1, 2, 2));
}

// With one value per voxel the values are the labels, whatever else the header says of segments.
TEST(VolumeFile, ASegmentationInOneLayerIsAnOrdinaryLabelMap) {
  const ScratchFolder folder;
  std::ofstream(folder.path() / "bones.seg.nrrd", std::ios::binary)
      << "NRRD0004\ntype: unsigned char\ndimension: 3\nsizes: 2 2 2\nspacings: 1 1 1\nencoding: raw\n"
      << "Segment0_LabelValue:=7\n\n"
      << std::string("\0\7\0\0\7\3\0\0", 8);
  EXPECT_THAT(ReadLabels(folder.path() / "bones.seg.nrrd").values,
              testing::ElementsAre(0, 7, 0, 0, 7, 3, 0, 0));
}

TEST(VolumeFile, LabelsMayBeRoundedButNotInterpolated) {
  const ScratchFolder folder;
  const auto read = [&](float value) {
    Grid grid;
    grid.size = {2, 2, 2};
    Volume volume(grid);
    volume.values[3] = value;
    WriteVolume(folder.path() / "labels.nii", volume, ScalarType::kFloat32);
    return ReadLabels(folder.path() / "labels.nii").values[3];
  };
  EXPECT_EQ(read(2.9999998f), 3);
  EXPECT_EQ(read(-1e-6f), 0);
  for (const float value : {0.5f, 2.99f, -1.0f, 65536.0f}) EXPECT_THROW(read(value), InputError) << value;
}

// As SPM and others write what lies beyond the field of view of a scan that they moved.
TEST_P(VolumeFormats, NotANumberWasNotMeasured) {
  const ScratchFolder folder;
  const auto path = folder.path() / GetParam();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Grid grid;
  grid.size = {2, 2, 2};
  Volume volume(grid);
  volume.values = {nan, 7, 3, nan, 5, 4, nan, 9};
  WriteVolume(path, volume, ScalarType::kFloat32);
  EXPECT_THAT(ReadScan(path).volume.values, testing::ElementsAre(3, 7, 3, 3, 5, 4, 3, 9));
  EXPECT_THAT(ReadLabels(path).values, testing::ElementsAre(0, 7, 3, 0, 5, 4, 0, 9));

  volume.values[1] = std::numeric_limits<float>::infinity();
  WriteVolume(path, volume, ScalarType::kFloat32);
  EXPECT_THROW(ReadScan(path), InputError);

  volume.values.assign(8, nan);
  WriteVolume(path, volume, ScalarType::kFloat32);
  EXPECT_THROW(ReadScan(path), InputError);
}

TEST(VolumeFile, ARawFileOfAnotherOriginIsNotReplaced) {
  const ScratchFolder folder;
  const Volume ramp = LinearRamp{}.On(ObliqueGrid());
  std::ofstream(folder.path() / "v.raw") << "from elsewhere";
  EXPECT_THROW(RequireWritableExtension(folder.path() / "v.mhd"), InputError);
  EXPECT_THROW(WriteVolume(folder.path() / "v.mhd", ramp, ScalarType::kFloat32), InputError);
  EXPECT_EQ(std::filesystem::file_size(folder.path() / "v.raw"), 14u);
  WriteVolume(folder.path() / "w.mhd", ramp, ScalarType::kUint8);
  WriteVolume(folder.path() / "w.mhd", ramp, ScalarType::kFloat32);  // its own is
  EXPECT_EQ(ReadScan(folder.path() / "w.mhd").volume.values, ramp.values);
}

// What ITK and we would take the header for.
TEST(VolumeFile, AMetaImageIsNotWrittenUnderANameThatItsHeaderCannotHold) {
  const ScratchFolder folder;
  const Volume ramp = LinearRamp{}.On(ObliqueGrid());
  for (const char* name : {"50%.mhd", " lead.mhd", "LIST.mhd", "two\nlines.mhd"}) {
    EXPECT_THROW(RequireWritableExtension(folder.path() / name), InputError) << name;
    EXPECT_THROW(WriteVolume(folder.path() / name, ramp, ScalarType::kFloat32), InputError) << name;
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  for (const char* name : {"50%.mha", "LIST.nrrd", "a list.mhd", "list.mhd"}) {
    WriteVolume(folder.path() / name, ramp, ScalarType::kFloat32);
    EXPECT_EQ(ReadScan(folder.path() / name).volume.values, ramp.values) << name;
  }
}

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

TEST(VolumeFile, BothFilesOfAMetaImageLieBehindALink) {
  const ScratchFolder folder;
  const Volume ramp = LinearRamp{}.On(ObliqueGrid());
  const auto there = folder.path() / "there";
  std::filesystem::create_directory(there);
  WriteVolume(there / "v.mhd", ramp, ScalarType::kUint8);
  std::filesystem::create_symlink(there / "v.mhd", folder.path() / "link.mhd");
  WriteVolume(folder.path() / "link.mhd", ramp, ScalarType::kFloat32);
  EXPECT_EQ(ReadScan(there / "v.mhd").volume.values, ramp.values);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "link.raw"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder.path() / "link.mhd"));
}

}  // namespace
}  // namespace kvx
