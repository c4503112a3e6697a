// One DICOM series, classic slices or an enhanced multi-frame image, as a volume.
#pragma once
#include <filesystem>

#include "pipeline/io/volume_info.h"

namespace kvx {

// `path`: a folder (searched through) with one series, or one multi-frame file. Segmentations, doses and the
// like beside it do not count. Throws InputError for several series, several volumes in one, slices that are
// missing, irregular, tilted or turned against each other, and colours.
Scan ReadDicomSeries(const std::filesystem::path& path);
VolumeInfo ReadDicomSeriesInfo(const std::filesystem::path& path);

}  // namespace kvx
