// Segmentations with several values per voxel, as 3D Slicer writes them (.seg.nrrd) where segments overlap or
// once did.
#pragma once
#include <filesystem>

#include "pipeline/io/layered_labels.h"

namespace kvx {

// Whether the NRRD file is such a segmentation; one value per voxel is an ordinary label map.
bool HoldsSegmentLayers(const std::filesystem::path& nrrd);

Grid SegmentLayersGrid(const std::filesystem::path& nrrd);

// The first segment of the file is label 1, the second 2, and so on. Where segments overlap, a voxel is the
// first one's. Throws InputError for what is damaged.
LayeredLabels ReadSegmentLayers(const std::filesystem::path& nrrd);

}  // namespace kvx
