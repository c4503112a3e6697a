// How points between voxels move beside a bone, whose border lies half way between its outermost voxels and
// the next ones.
#pragma once
#include <algorithm>
#include <span>

#include "core/bone_of_label.h"

namespace kvx {

struct BoneShare {
  int bone = kNoBone;  // kNoBone where no corner is of one
  double share = 0;    // of the motion: the bone's own; the rest is the weighted mean of the other corners'
};

// At a point between voxels: `parts`, their trilinear weights, and the bone of each, or kNoBone. A bone of
// which half the weight is moves the point alone; below a third it has its trilinear part, as the soft tissue
// and cartilage there need (docs/results.md, by tissue), and between them its share rises, so that all is
// continuous but for where two bones touch.
inline BoneShare ShareOfBone(std::span<const double> parts, std::span<const int> bones) {
  BoneShare most;
  for (const int bone : bones) {
    if (bone == kNoBone || bone == most.bone) continue;
    double sum = 0;
    for (size_t corner = 0; corner < parts.size(); ++corner) sum += bones[corner] == bone ? parts[corner] : 0;
    if (sum > most.share) most = {bone, sum};
  }
  most.share = std::max(most.share, std::clamp(4 * most.share - 1, 0.0, 1.0));
  return most;
}

}  // namespace kvx
