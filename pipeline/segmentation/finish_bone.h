// What a bone must be whatever cut it out: pieces that strokes touch, without holes but those in which the
// background was marked, with a calm surface, and nowhere where a stroke says otherwise.
#pragma once
#include "core/voxels/voxel_box.h"

namespace kvx {

struct BoneFinish {
  Mask mask;          // on the grid of the box
  double marked = 1;  // share of it that its strokes mark, from 0 to 1
  bool bare = false;  // more was found, but not where several strokes lie; of calm ones only
};
constexpr double kMostlyMarked = 0.5;  // hardly more than the strokes was found

// `calm`: smoothed. Not for CT, where a process of a vertebra in thick slices is a voxel thin.
BoneFinish FinishBone(const LabelMap& labels, const LabelMap& strokes, int label, const VoxelBox& box,
                      bool calm = true);

// As large as the mask, blurred by a binomial filter of three voxels an axis: calmer, but not thinner. Holds
// `keep`.
Mask Smoothed(const Mask& mask, const Mask& keep);

}  // namespace kvx
