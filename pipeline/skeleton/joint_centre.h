// Where a joint turns, from the motions of its child relative to its parent.
#pragma once
#include <optional>
#include <span>

#include "core/bone.h"
#include "pipeline/skeleton/relative_motion.h"

namespace kvx {

// Where a joint's centre is taken to be before any motion is seen.
struct CentreBelief {
  PointMm place;
  double weight = 0;  // beside that of a scan turned by a radian
};
// The middle of the gap between the bones (without one, the base of the child's box). About a head, half the
// parent's thickness inside it from there: the surface of a round head is as far from its centre all around.
CentreBelief UsualCentre(const BoneSet& bones, int child, bool turns_about_head);

// Least squares centre: sum_k w_k |(R_k - I) c + t_k|^2 + lambda sum_k w_k |c - usual|^2. The second term
// decides what the motion leaves open: the place along the axis of a planar motion.
PointMm FitCentre(std::span<const RelativeMotion> motions, const CentreBelief& usual);
double CentreResidualMm(std::span<const RelativeMotion> motions, const PointMm& centre);

// Middle of the region where two bones come closest; nothing when they stay far apart.
std::optional<PointMm> FindGap(const LabelMap& labels, int parent_label, int child_label);

}  // namespace kvx
