// DICOM segmentations (SEG; PS3.3, A.51, and A.101 of those whose voxels are segments' numbers) as label
// maps.
#pragma once
#include <filesystem>
#include <optional>

#include "core/frames.h"
#include "pipeline/io/layered_labels.h"

namespace kvx {

// `path`: a folder (searched through), or one file. A segment's label is its number there; a probability is
// inside from a half on. Planes that the file leaves out are empty. Where segments overlap, a voxel is the
// first one's. Nothing where `path` holds no segmentation. Throws InputError for several, for what is
// damaged, and for segments or places that are not told.
std::optional<LayeredLabels> FindDicomSegments(const std::filesystem::path& path);
std::optional<Grid> FindDicomSegmentsGrid(const std::filesystem::path& path);

}  // namespace kvx
