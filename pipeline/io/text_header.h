// A first look at NRRD and MetaImage headers, before ITK believes them.
#pragma once
#include <filesystem>
#include <vector>

#include "pipeline/io/itk_image.h"

namespace kvx {

// Upper bound of the bytes that the voxels can unpack to, from the sizes of the files on disk. Throws
// InputError for sizes or dimensions that make no sense and for data files that
// do not lie beside the header: a header must not reach elsewhere.
double RequireSaneTextHeader(FileFormat format, const std::filesystem::path& path);

// The file beside the header that holds the voxels; empty where they follow the header itself. Throws
// likewise.
std::filesystem::path DetachedDataOf(FileFormat format, const std::filesystem::path& path);

// Whether a NRRD's world is left-anterior-superior: x to the left, y to the front.
bool IsLeftAnteriorSuperior(const std::filesystem::path& nrrd);

// Where a segment of a NRRD segmentation is, as 3D Slicer writes it: in which of the values that a voxel has,
// and which value.
struct Segment {
  int layer = 0, value = 0;
};
bool NamesSegments(const std::filesystem::path& nrrd);  // a segmentation, by its own account
// In the file's order; none where it says nothing of segments. Throws InputError for what makes no sense.
std::vector<Segment> SegmentsOf(const std::filesystem::path& nrrd);

}  // namespace kvx
