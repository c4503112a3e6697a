// One DICOM series, classic slices or an enhanced multi-frame image, as a volume.
#pragma once
#include <filesystem>

#include "pipeline/io/volume_file.h"

namespace kvx {

// A scan is of the body: segmentations, doses and the like beside it do not count. For labels a segmentation
// (SEG) comes first, where there is one.
enum class DicomUse { kScan, kLabels };

// `path`: a folder (searched through) with one series, or one multi-frame file. Throws InputError for several
// series, several volumes in one, slices that are missing, irregular,
// tilted or turned against each other, colours, and segmentations of several segments.
Scan ReadDicomSeries(const std::filesystem::path& path, DicomUse use);
VolumeInfo ReadDicomSeriesInfo(const std::filesystem::path& path, DicomUse use);

}  // namespace kvx
