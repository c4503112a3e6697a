// Bones of an MR scan looked for from their strokes: bright marrow in dark shells.
#pragma once
#include <vector>

#include "core/host/progress.h"
#include "pipeline/segmentation/strokes/bone_doubt.h"
#include "pipeline/segmentation/strokes/expected_dice.h"
#include "pipeline/segmentation/strokes/found_bone.h"

namespace kvx {

struct MrBones {
  std::vector<FoundBone> bones;    // box by box
  std::vector<SearchSigns> signs;  // of each, but for what strokes say
  std::vector<BoneDoubt> doubts;
};

// `scan`: 0 where there is no signal. `kept`: bones that are not looked for, 0 elsewhere. Bones may overlap;
// their strokes are in none but their own.
MrBones FindMrBones(const Volume& scan, const LabelMap& strokes, const std::vector<StrokeBox>& boxes,
                    const LabelMap& kept, const Progress& progress);

}  // namespace kvx
