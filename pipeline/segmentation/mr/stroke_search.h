// Bones of an MR scan looked for from their strokes, with and without a shell, each by itself but for the
// colours they share.
#pragma once
#include "core/progress.h"
#include "pipeline/segmentation/mr/stroke_bone.h"

namespace kvx {

struct StrokeBox {
  int label = 0;
  VoxelBox box;  // of the bone's strokes
};

struct FoundBone {
  int label = 0;
  VoxelBox box;       // as large as the search needed; on its voxels:
  Mask mask;          // with cortex
  Image<float> lean;  // 1: bone for sure, -1: not; infinite on the bone's strokes
  bool reaches_box = false;
  Mask marrow = {};  // MR only
};

// For each bone one answer, and a second one where the search asks for the shell. `air`: 1 where no bone is,
// whatever it looks like.
std::vector<std::vector<FoundBone>> FindBones(const Volume& scan, const LabelMap& strokes,
                                              const LabelMap& air, const std::vector<StrokeBox>& boxes,
                                              const StrokeSearch& search, const Progress& progress);

}  // namespace kvx
