// How many poses a set of motions needs, and which to scan next (paper, section 6.2).
#pragma once
#include "pipeline/posing/key_frames.h"

namespace kvx {

struct ProposedScan {
  int pose = 0;                  // index into the poses given
  double uncertainty_after = 0;  // mean over poses and bones, once this one and those before it are scanned
};

struct PosePlan {
  std::vector<double> explained;  // share of the motions' variation by the first 1, 2, ... eigenposes
  double uncertainty = 0;  // mean over poses and bones, with the scans there are (PoseSpace::Uncertainty)
  std::vector<ProposedScan> next;  // best first; each chosen given those before it
};

// Eigenposes that explain at least `share` of the variation.
int EigenposesFor(const PosePlan& plan, double share);

// `poses`: joint angles of the motions, in the order of Skeleton::joints. Proposes at most `scans` of them,
// and none that tells next to nothing.
PosePlan PlanPoses(const PoseSpace& space, const std::vector<JointAngles>& poses, int scans);

// Joint angles along a motion, at most `most` of them, evenly spread.
std::vector<JointAngles> AnglesAlong(const PoseResolver& model, const KeyFrames& frames, int most,
                                     std::vector<double>& times_s);

}  // namespace kvx
