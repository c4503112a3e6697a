// One joint from the motions of its child relative to its parent, all in template world.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "core/bone.h"
#include "core/pose.h"
#include "core/skeleton.h"

namespace kvx {

// parent_template^-1 * child of one scan, and how far it is to be trusted (0..1).
struct RelativeMotion {
  RigidTransform motion;
  double weight = 1;
  // Covariance of how `motion` turns, as a small turn applied before it (rad^2). Zero: nothing is known of
  // it.
  Eigen::Matrix3d turn_spread = Eigen::Matrix3d::Zero();
};
RelativeMotion MotionOf(const BoneFit& parent, const BoneFit& child, double weight);

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

constexpr double kShownTurnRad = RadFromDeg(5);  // a smaller turn is within what bones are found to

// Orthogonal axes (columns): the dominant axis of rotation, the dominant one across it, and their cross
// product. Where the motion is too small to decide, those of the bone's box: across its width, across its
// thickness, along it. Scans count by how well they know a turn, and a long bone is taken to turn across its
// length unless they show otherwise. The first `dof_count` of them are then turned together to explain the
// rotations best as an ordered product. With beliefs about the first axis, it is the one near them, whether
// or not it is dominant.
// With conjunct rotation, the first axis is that of bending alone, and of three the last lies along the bone:
// a long bone may at the same time turn about its length, in proportion (the knee's screw home; two fixed
// axes after Hollister et al. 1993, "The axes of rotation of the knee"). One axis for both would lie between
// them.
struct AxisBelief {
  Eigen::Vector3d axis;  // unit; its sign says nothing
  double spread_rad;
};
struct JointKnowledge {
  std::vector<AxisBelief> near;    // where the first axis lies
  bool conjunct_rotation = false;  // the bone may turn about its length as it bends
};
Eigen::Matrix3d FitAxes(std::span<const RelativeMotion> motions, const OrientedBox& box, int dof_count,
                        const JointKnowledge& known = {});

// How well the first of fitted axes is known: variance of its tilt, per direction across it (rad^2).
double FirstAxisVariance(std::span<const RelativeMotion> motions, const OrientedBox& box, int dof_count,
                         const JointKnowledge& known, const Eigen::Matrix3d& axes);

// Angles that bring the ordered product of rotations about `axes` closest to a rotation.
Eigen::VectorXd AnglesOf(std::span<const Eigen::Vector3d> axes, const Eigen::Quaterniond& rotation);

}  // namespace kvx
