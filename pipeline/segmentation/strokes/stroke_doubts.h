// Where strokes and the bones that were found from them do not go together.
#pragma once
#include <map>

#include "core/image.h"
#include "core/voxels/voxel_box.h"

namespace kvx {

constexpr size_t kSeveralApart = 3, kSeveralWithin = 2;  // voxels of strokes; fewer may be slips

// How many voxels of a bone's strokes lie in pieces of it that do not touch its largest one, not even corner
// to corner. `box`: of the bone.
size_t StrokesApart(const LabelMap& labels, const LabelMap& strokes, int label, const VoxelBox& box);

// By label of a bone: how many voxels of other strokes, the background's or another bone's, lie inside it.
// On at least five of the six ways along the axes it is what comes after the stroke.
std::map<int, size_t> StrokesWithin(const LabelMap& labels, const LabelMap& strokes);

}  // namespace kvx
