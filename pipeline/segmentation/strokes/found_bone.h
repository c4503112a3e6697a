// What a search for bones from their strokes is given, and what it finds of each, in MR and CT alike.
#pragma once
#include <vector>

#include "core/voxels/voxel_box.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"

namespace kvx {

struct StrokeBox {
  int label = 0;
  VoxelBox box;  // of the bone's strokes
};

// Of all labels but the background's.
inline std::vector<StrokeBox> StrokeBoxes(const LabelMap& strokes) {
  std::vector<StrokeBox> boxes;
  for (const auto& [label, box] : BoxesOf(strokes))
    if (label != kBackgroundStroke) boxes.push_back({label, box});
  return boxes;
}

struct FoundBone {
  int label = 0;
  VoxelBox box;       // as large as the search needed; on its voxels:
  Mask mask;          // with cortex
  Image<float> lean;  // 1: bone for sure, -1: not; infinite on the bone's strokes
  bool reaches_box = false;
  Mask marrow = {};  // MR only
};

}  // namespace kvx
