// A label map as a DICOM segmentation (SEG) of the images that it lies on, as viewers draw over them.
#pragma once
#include <filesystem>
#include <map>
#include <string>

#include "core/frames.h"
#include "core/image.h"
#include "pipeline/io/dicom/dicom_writer.h"

namespace kvx {

// Writes one file (PS3.3, A.51) with a segment for each of `names`, the bones' by label: numbered from 1 in
// the order of labels, as the standard wants it. One bit a voxel; a segment has frames in the planes that it
// is in, and one empty frame where it is in none. `series` says whom it is of; its modality does not matter.
// `of`: the images, one a plane of the labels' grid. The same labels, names and images give the same bytes.
// Throws InputError for no names, Unavailable when the file cannot be written.
void WriteDicomSegmentation(const std::filesystem::path& path, const LabelMap& labels,
                            const std::map<int, std::string>& names, DicomSeries series,
                            const DicomImages& of);

}  // namespace kvx
