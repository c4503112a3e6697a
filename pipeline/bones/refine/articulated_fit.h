// All bones of one scan together, at the scan's own voxels: bones are rigid and the tissue just around them
// moves by skinning (eq. 2), so that it helps to decide how a round bone is turned and does not mislead where
// a neighbour moves.
#pragma once
#include "core/pose.h"
#include "pipeline/bones/template/bone_tissue.h"

namespace kvx {

struct BoneEstimate {
  RigidTransform scan_from_template;
  // Of a bone that keeps its start, how far off the fit would have it counts as a deviation.
  Twist6Covariance covariance = Twist6Covariance::Zero();
  double correlation = 0;
  double seen = 0;          // part of the tissue that falls into the scan
  bool left_reach = false;  // the fit lies beyond it
};

// Gauss-Newton rounds over all bones from `start`, until all are at rest but those `in_doubt` (none, or one
// for each bone). `tissue` is of `template_image`. A bone that would move by more than `reach_mm[b]` keeps
// its start. One that is still on its way at last is known no better than its last round moved it.
std::vector<BoneEstimate> FitArticulated(const std::vector<BoneTissue>& tissue,
                                         const CubicImage& template_image, const CubicImage& scan,
                                         const PoseVector& start, const std::vector<double>& reach_mm,
                                         const std::vector<bool>& in_doubt = {});

}  // namespace kvx
