// Stage `joints`: centres of rotation and axes from all poses, limits, and the joint angles of every scan.
// A joint's first degree of freedom is the dominant axis of its rotations, the second the dominant one across
// it, the third their cross product; rotations under 5 degrees leave the choice to the bone's box. Which
// way axes point: axis_signs.h.
#pragma once
#include "pipeline/runner.h"

namespace kvx {

struct SkeletonFit {
  Skeleton skeleton;
  std::vector<JointAngles> scan_angles;  // per scan, in the order of Inputs::fits
  std::vector<std::vector<Twist>>
      scan_residuals;  // per scan, per bone: what angles alone do not explain (core/skeleton.h)
  std::vector<RigidTransform> scan_roots;  // root motion per scan
  // Per bone's joint and degree of freedom: the tilt that its axis stays within 19 times in 20; infinite
  // where the scans do not tell.
  std::vector<std::vector<double>> axis_within_rad;
  double AxisWithinRad(int joint,
                       size_t dof) const;  // infinite too where it was fitted by an earlier version
};
template <class A>
void Fields(A& a, SkeletonFit& v) {
  a(v.skeleton, v.scan_angles, v.scan_residuals, v.scan_roots);
  a.AtTheEnd(v.axis_within_rad);  // of version 10 of the stage
}

// What limits are wider than the scans show, at both ends.
constexpr double kLimitMarginRad = 0.0873;  // 5 degrees
constexpr double kLimitMarginMm = 2;        // of shifts

// From the least to the greatest value of a degree of freedom in the scans, the template's 0 among them.
struct ScannedRange {
  double min_rad = 0, max_rad = 0;
};
ScannedRange ScannedRangeOf(const DegreeOfFreedom& dof, bool shift);

struct FitSkeleton {
  static constexpr std::string_view kName = "joints";
  static constexpr int kVersion = 13;
  struct Inputs {
    const Artifact<BoneSet>& bones;
    const std::vector<Artifact<BoneFits>>& fits;  // of every scan but the template
    std::vector<Digest> Keys() const;
  };
  struct Options {
    Region region = Region::kCustom;
    std::vector<StudyJoint> joints;  // empty: the preset; custom without joints: rotation about 3 axes
    double limit_margin_rad = kLimitMarginRad;
  };
  using Output = SkeletonFit;
  // ForwardKinematics(skeleton, scan_angles[k], scan_roots[k],
  // scan_residuals[k]) gives scan k's bone poses back exactly.
  static Output Run(const Inputs& inputs, const Options& options, StageContext& context);
};
template <class A>
void Fields(A& a, FitSkeleton::Options& v) {
  a(v.region, v.joints, v.limit_margin_rad);
}

// The angles that bring a skeleton closest to given bone poses, and the residual twists that remain.
struct PoseAnalysis {
  JointAngles angles;
  std::vector<Twist> residuals;
  RigidTransform root;
};
PoseAnalysis AnalysePose(const Skeleton& skeleton, const PoseVector& scan_from_template);

}  // namespace kvx
