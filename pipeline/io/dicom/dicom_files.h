// Which DICOM files are meant, of all that a folder holds. Exports of whole studies hold localisers,
// screenshots, segmentations and doses beside the volume.
#pragma once
#include <filesystem>
#include <vector>

#include "pipeline/io/dicom/dicom_header.h"

namespace kvx {

// The headers of all images in the folder `path` (searched through), or of the one file.
std::vector<DicomFile> ReadDicomHeaders(const std::filesystem::path& path);

// Of all files those of the only series that may be a scan, without copies, all of whose images say where
// they lie. Throws InputError where there is none or more than one, and for several echoes and colours.
std::vector<DicomFile> ScanFiles(std::vector<DicomFile> all);

// The same of a segmentation (SEG); none where there is no segmentation.
std::vector<DicomFile> SegmentationFiles(const std::vector<DicomFile>& all);

}  // namespace kvx
