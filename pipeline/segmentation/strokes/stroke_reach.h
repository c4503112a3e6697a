// How hard a voxel is to reach from a bone's strokes. One stroke that sticks out of the bone must not let
// everything outside in, so several parts of the strokes have to agree.
#pragma once
#include "pipeline/segmentation/strokes/geodesic.h"

namespace kvx {

// Geodesic millimetres (options.most_mm where farther). The strokes are parted into groups by place, at
// most so many, and the groups into those that reach each other: several compartments may belong to one bone
// (the carpal block). A voxel's reach is, in the compartment that reaches it best, that of the best of up to
// four groups, of the second best of up to eight, the third of up to twelve, the fourth of more.
Image<float> ReachFromStrokes(const Volume& relative, const std::vector<size_t>& strokes,
                              const GeodesicOptions& options, size_t most_groups);

}  // namespace kvx
