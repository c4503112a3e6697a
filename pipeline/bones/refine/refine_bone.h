// Gauss-Newton refinement of one bone's pose: 6 degrees of freedom, gain and bias (eq. 1).
#pragma once
#include "pipeline/bones/template/bone_samples.h"

namespace kvx {

constexpr double kSeenPart = 0.3;  // of a bone's samples, below which the scan does not show it

struct PoseFit {
  RigidTransform scan_from_template;
  double correlation = 0;
  double inside = 0;  // part of the samples that fall into the scan
};

// Minimises sum (t - a s(T x) - b)^2 over T, a and b, which is maximising the correlation. A step is taken
// only when it helps; steps are damped and never longer than a scan voxel or two.
PoseFit RefinePose(const Volume& scan, const BoneSamples& samples, const RigidTransform& start,
                   int iterations);
// Trust in each sample at a pose: near 1 where gain and bias explain the scan, near 0 where the tissue beside
// the bone changed.
std::vector<float> TrustOf(const Volume& scan, const BoneSamples& samples, const RigidTransform& pose);
// RefinePose with trust found anew in each round: soft tissue that slides along the bone no longer turns it.
RigidTransform RefinePoseRobustly(const Volume& scan, const BoneSamples& samples, const RigidTransform& start,
                                  int rounds);
// Correlation at a pose as it is.
PoseFit FitAt(const Volume& scan, const BoneSamples& samples, const RigidTransform& pose);

}  // namespace kvx
