// Reading and writing by ITK's format classes, one chosen explicitly per format:
// no factories, no global state.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "pipeline/io/voxel_values.h"

namespace kvx {

// The line that ends the header of a MetaImage whose voxels follow in the same file.
inline constexpr std::string_view kVoxelsFollow = "ElementDataFile = LOCAL\n";

enum class FileFormat { kNifti, kNrrd, kMeta };

struct ItkHeader {
  Grid grid;
  VoxelType type = VoxelType::kUint8;
  Rescale rescale;
};

// NRRD and MetaImage only. Throws InputError for what is not a 3-D scalar volume.
// ITK's own words never leave.
ItkHeader ReadItkHeader(FileFormat format, const std::filesystem::path& path);
Scan ReadItkScan(FileFormat format, const std::filesystem::path& path);

// A NRRD with one or more values per voxel.
struct ItkLayers {
  Grid grid;
  int count = 1;              // of layers
  std::vector<float> values;  // those of a voxel side by side; empty unless asked for
};
ItkLayers ReadItkLayers(const std::filesystem::path& nrrd, bool with_values);

// The image or images of one DICOM file, as the decoder gives them; their place is read elsewhere.
struct ItkPlanes {
  int columns = 0, rows = 0, count = 1;
  VoxelType type = VoxelType::kUint8;
  Rescale applied;            // by the decoder, which does not know of all kinds of images that have one
  std::vector<float> values;  // empty unless asked for
};
// `undecoded`: what the InputError says where the decoder fails.
ItkPlanes ReadDicomPlanes(const std::filesystem::path& file, bool with_values, const char* undecoded);

// `bytes`: voxels of `type`, `components` together per voxel.
// Throws Unavailable when the file cannot be written.
void WriteItk(FileFormat format, const std::filesystem::path& path, const Grid& grid, ScalarType type,
              int components, const std::string& bytes, bool compressed);

}  // namespace kvx
