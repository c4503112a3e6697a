// DICOM segmentations (SEG; PS3.3, A.51, and A.101 of those whose voxels are segments' numbers) as label
// maps.
#pragma once
#include <optional>
#include <vector>

#include "core/frames.h"
#include "pipeline/io/dicom/dicom_header.h"
#include "pipeline/io/layered_labels.h"

namespace kvx {

// `headers`: of a folder, or of one file, as ReadDicomHeaders gives them. A segment's label is its number
// there; a probability is inside from a half on. Planes that the file leaves out are empty. Where segments
// overlap, a voxel is the first one's. Nothing where there is no segmentation among them. Throws InputError
// for several, for what is damaged, and for segments or places that are not told.
std::optional<LayeredLabels> FindDicomSegments(const std::vector<DicomFile>& headers);
std::optional<Grid> FindDicomSegmentsGrid(const std::vector<DicomFile>& headers);

}  // namespace kvx
