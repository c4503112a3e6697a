// What a search for bones from their strokes is given, and what it finds of each, in MR and CT alike.
#pragma once
#include "core/voxel_box.h"

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

}  // namespace kvx
