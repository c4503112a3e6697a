// What the angles of joints do not say of bones' motion, between the scans: how a kneecap glides, how a shin
// turns as the knee is straightened, play.
#pragma once
#include "pipeline/examples/pose_space.h"

namespace kvx {

// Interpolated as examples are, but by what the residuals themselves have in common: tissue's examples are
// noisier than a bone's pose, and would have a bone stay behind between two scans.
class BoneResiduals {
 public:
  BoneResiduals() = default;
  // `moments`: which scans show what lies near a bone. Of the others, and of a joint whose parent they do not
  // show, the residual is the one that the rest leads to expect.
  BoneResiduals(const SkeletonFit& fit, const ExampleMoments& moments);

  // One per bone; exact at scans that show it and its parent.
  std::vector<Twist> At(const JointAngles& angles) const;

 private:
  PoseSpace space_;
  std::vector<std::vector<Twist>> of_scans_;  // per scan, per bone
};

}  // namespace kvx
