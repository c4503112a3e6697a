// From strokes to a label map: every bone by itself, then all together.
#pragma once
#include <map>
#include <vector>

#include "core/host/progress.h"
#include "core/image.h"
#include "pipeline/segmentation/strokes/bone_doubt.h"

namespace kvx {

struct GrownBones {
  LabelMap labels;  // the labels of the strokes, without the background's
  std::vector<BoneDoubt> doubts;
  std::map<int, double> expected_dice;  // by label, of the bones that were looked for in an MR
};

// `strokes`: on the scan's grid; bone labels and 255 for the background. `previous`: none, or the labels that
// fewer strokes gave, on the same grid: a bone that no stroke contradicts keeps them; one that has none keeps
// those that none contradicts. Throws InputError without strokes of a bone or previous bones. In MR the bones
// do not depend on the order in which voxels are stored.
GrownBones GrowBones(const Volume& scan, const LabelMap& strokes, bool ct, const Progress& progress,
                     const LabelMap* previous = nullptr);

}  // namespace kvx
