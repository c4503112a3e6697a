// Whether a NRRD or MetaImage header says where its voxels lie. ITK takes a spacing that is not a number for
// 1 mm, as it does one that is not there, and of most others says only that it failed.
#pragma once
#include "pipeline/io/text_header.h"

namespace kvx {

// Throws InputError where it does not: spacings, axes or an origin that are no numbers or too few, no spacing
// at all, and spaces that are not a patient's. Axes of a NRRD that are none of the image, such as values of a
// voxel, need none.
void RequireGeometry(const TextHeader& header);

}  // namespace kvx
