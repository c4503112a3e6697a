// One DICOM series, classic slices or an enhanced multi-frame image, as a volume.
#pragma once
#include <vector>

#include "pipeline/io/dicom/dicom_header.h"
#include "pipeline/io/volume_info.h"

namespace kvx {

// `headers`: of a folder with one series, or of one multi-frame file, as ReadDicomHeaders gives them.
// Segmentations, doses and the like beside it do not count. Throws InputError for several series, several
// volumes in one, slices that are missing, irregular, tilted or turned against each other, and colours.
Scan ReadDicomSeries(std::vector<DicomFile> headers);
VolumeInfo ReadDicomSeriesInfo(std::vector<DicomFile> headers);

}  // namespace kvx
