// Bones of a CT looked for from their strokes: dense shells and what they enclose.
#pragma once
#include <vector>

#include "core/host/progress.h"
#include "pipeline/segmentation/strokes/found_bone.h"

namespace kvx {

// `scan_hu`: Hounsfield units. Marrow is often no denser than muscle, so looks say little; what counts is
// which of a bone's strokes, the other bones' and the outside gets to a voxel with the smallest falls of
// density on the way out of bone. Each bone by itself, in a box around its strokes.
std::vector<FoundBone> FindCtBones(const Volume& scan_hu, const LabelMap& strokes,
                                   const std::vector<StrokeBox>& boxes, const Progress& progress);

}  // namespace kvx
