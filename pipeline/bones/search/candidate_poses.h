// Where a bone might be: the poses that the coarse search tries.
#pragma once
#include <vector>

#include "pipeline/bones/search/plausibility.h"

namespace kvx {

// Distance between neighbouring places that are tried; from half of it, refinement finds its way.
double StepMm(const BoneShape& bone);

// Rotation vectors on a cubic lattice of the given step within `limit_rad`.
std::vector<Eigen::Vector3d> RotationLattice(double step_rad, double limit_rad);

// Rotations up to 75 degrees and places all over the scan, farther apart where there would be too many to
// look at. Made when asked for: a thin bone's would fill gigabytes.
class RootCandidates {
 public:
  RootCandidates(const BoneShape& root, const Grid& scan);
  size_t size() const { return turns_.size() * size_t(steps_.prod()); }
  RigidTransform operator[](size_t n) const;

 private:
  Eigen::Vector3d centroid_mm_;
  Grid scan_;
  std::vector<Eigen::Quaterniond> turns_;
  Eigen::Vector3i steps_;  // places along each axis
};
// Swing in every direction up to 120 degrees, twist up to 50, about each pivot of the joint, with small
// shifts of it.
std::vector<RigidTransform> JointCandidates(const BoneShape& child, const JointShape& joint,
                                            const RigidTransform& parent);
// Motions that bones nearby suggest: theirs, and blends of the parent's with theirs.
std::vector<RigidTransform> SuggestedMotions(const std::optional<RigidTransform>& parent,
                                             const std::vector<int>& neighbours, const PartialPose& placed);
// Small turns and shifts of a bone about `pose`.
std::vector<RigidTransform> LocalCandidates(const BoneShape& bone, const RigidTransform& pose);

// The twelve poses beside `pose`: turned about the bone's centroid and shifted along every axis, either way.
std::vector<RigidTransform> PosesBeside(const BoneShape& bone, const RigidTransform& pose, double step_mm);

}  // namespace kvx
