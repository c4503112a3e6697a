// How points between voxels move beside a bone, whose border lies half way between its outermost voxels and
// the next ones.
#pragma once
#include <algorithm>
#include <array>

#include "core/bone_of_label.h"

namespace kvx {

struct BoneShare {
  int bone = kNoBone;  // kNoBone where no corner is of one
  double share =
      0;  // of the motion that is the bone's own; the rest is the weighted mean of the other corners'
};

// At a point between eight voxels: `parts`, their trilinear weights, and the bone of each, or kNoBone. A bone
// of which half the weight is moves the point alone; below that its motion fades to none, so that all is
// continuous but for where two bones touch.
inline BoneShare ShareOfBone(const std::array<double, 8>& parts, const std::array<int, 8>& bones) {
  BoneShare most;
  for (const int bone : bones) {
    if (bone == kNoBone || bone == most.bone) continue;
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) sum += bones[corner] == bone ? parts[corner] : 0;
    if (sum > most.share) most = {bone, sum};
  }
  most.share = std::min(1.0, 2 * most.share);
  return most;
}

}  // namespace kvx
