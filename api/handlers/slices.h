// Posed slices of a built model.
#pragma once
#include "api/handlers/pose_query.h"

namespace kvx {

// Query: the pose as for volumes; axis and mm, or centre, right and down; projection, slab_mm, width_mm,
// height_mm, pixel_mm, window, format=png|nii.gz|nrrd. `pose` is the body of a POST, empty for GET.
FileAnswer GetSlice(Services& services, const std::string& model, const Query& query, const std::string& pose,
                    const Conditions& conditions);

}  // namespace kvx
