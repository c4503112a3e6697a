// A pose made ready for the posing engine: where every bone is, and how much of each example to add.
#pragma once
#include "core/deformation_mode.h"
#include "core/weight_map.h"
#include "pipeline/examples/bone_residuals.h"

namespace kvx {

struct ResolvedPose {
  PoseVector scan_from_template;  // one per bone
  Eigen::MatrixXf coefficients;   // bones x scans; all zero for VBD
  Eigen::VectorXd extrapolation;  // per bone, see PoseSpace
  bool elastic = false;           // beyond what the examples say, tissue comes to rest
};
// c_k of eq. 6 at a voxel of these weights.
inline double CoefficientAt(const VoxelWeights& w, const Eigen::MatrixXf& coefficients, Eigen::Index k) {
  double sum = 0;
  for (int s = 0; s < kBonesPerVoxel; ++s) sum += double(w.weights[s]) * coefficients(w.bones[s], k);
  return sum;
}
// The pose as resolved by EVD, posed by `mode` instead.
ResolvedPose InMode(ResolvedPose by_evd, DeformationMode mode);
bool IsSame(const ResolvedPose& a, const ResolvedPose& b);  // poses all tissue alike

// Of the worst placed bone.
inline double LargestExtrapolation(const ResolvedPose& pose) {
  return pose.extrapolation.size() ? pose.extrapolation.maxCoeff() : 0;
}

struct PoseResolver {
  const std::vector<std::string>& bone_names;
  const std::vector<std::string>& scan_names;  // training scans, template excluded
  const std::string& template_scan;
  const SkeletonFit& fit;
  const std::vector<PoseVector>& scan_poses;  // as registered, same order as scan_names
  const PoseSpace& space;
  const BoneResiduals& residuals;

  // Angles: forward kinematics plus interpolated residuals, root at the template. Bone transforms: taken as
  // they are; the coefficients follow from their joint angles. Scan: its registered bones, its example alone,
  // in which tissue is at rest. Throws NotFound naming what exists.
  ResolvedPose Resolve(const PoseRequest& request, DeformationMode mode) const;
  ResolvedPose ResolveAngles(const JointAngles& angles, DeformationMode mode) const;
  JointAngles AnglesOf(const AnglePose& asked) const;  // names to positions; throws NotFound, InputError
};

}  // namespace kvx
