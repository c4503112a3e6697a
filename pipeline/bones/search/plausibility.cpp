// Joint and overlap terms.
#include "pipeline/bones/search/plausibility.h"

#include <algorithm>

namespace kvx {
namespace {

// Gaussian near 0, logarithmic far out: an odd joint costs some nats, never all evidence.
double HeavyTail(double value, double scale) { return -2.0 * std::log1p(value * value / (scale * scale)); }

double TwistRad(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& axis) {
  const double along = rotation.vec().dot(axis);
  const double angle = 2 * std::atan2(along, rotation.w());
  return std::abs(std::remainder(angle, 2 * kPi));
}

bool FarApart(const BoneShape& a, const BoneShape& b, const RigidTransform& b_from_a) {
  const double distance = ((b_from_a * PointMm{a.centroid_mm}).lps - b.centroid_mm).norm();
  return distance > 0.5 * (a.extent_mm.norm() + b.extent_mm.norm());
}

struct PairOverlap {
  double of_a = 0, of_b = 0;
};

PairOverlap OverlapOf(const Anatomy& anatomy, int a, const RigidTransform& pose_a, int b,
                      const RigidTransform& pose_b) {
  const RigidTransform b_from_a = pose_b.Inverse() * pose_a;
  if (FarApart(anatomy.bones[a], anatomy.bones[b], b_from_a)) return {};
  const double tolerance_mm = 0.75 * anatomy.voxel_mm;
  return {OverlapFraction(anatomy.bones[a], anatomy.bones[b], b_from_a, tolerance_mm),
          OverlapFraction(anatomy.bones[b], anatomy.bones[a], b_from_a.Inverse(), tolerance_mm)};
}

}  // namespace

JointState JointStateOf(const BoneShape& child, const JointShape& joint, const RigidTransform& parent,
                        const RigidTransform& child_pose) {
  const RigidTransform motion = parent.Inverse() * child_pose;  // in the template
  JointState state;
  state.rotation_rad = motion.AngleRad();
  if (child.Elongated()) state.twist_rad = TwistRad(motion.rotation, child.axes.col(0));
  state.shift_mm = joint.pivots_mm.empty() ? 0 : 1e30;
  for (const Eigen::Vector3d& pivot : joint.pivots_mm) {
    state.shift_mm = std::min(state.shift_mm, ((motion * PointMm{pivot}).lps - pivot).norm());
  }
  return state;
}

double JointNats(const JointState& state, const BoneShape& child, double slack_mm) {
  const double shift_mm = std::max(0.0, state.shift_mm - slack_mm);
  const double turn = state.rotation_rad / RadFromDeg(60), twist = state.twist_rad / RadFromDeg(30);
  return -0.5 * (turn * turn + twist * twist) + HeavyTail(shift_mm, 0.2 * child.thickness_mm);
}

double RootNats(const RigidTransform& scan_from_template) {
  const double turn = scan_from_template.AngleRad() / RadFromDeg(40);
  return -0.5 * turn * turn;
}

double GapChangeMm(const BoneShape& child, const BoneShape& parent, const JointShape& joint,
                   const RigidTransform& parent_from_child) {
  return GapMm(child, parent, parent_from_child) - joint.gap_mm;
}

double GapNats(double gap_change_mm, const BoneShape& child, double voxel_mm) {
  return HeavyTail(gap_change_mm, voxel_mm + 0.08 * child.thickness_mm);
}

double WorstOverlap(const Anatomy& anatomy, int bone, const RigidTransform& pose, const PartialPose& placed) {
  double worst = 0;
  for (int other = 0; other < int(placed.size()); ++other) {
    if (other == bone || !placed[other]) continue;
    const PairOverlap overlap = OverlapOf(anatomy, bone, pose, other, *placed[other]);
    worst = std::max({worst, overlap.of_a, overlap.of_b});
  }
  return worst;
}

double OverlapNats(const Anatomy& anatomy, const std::vector<double>& independent_samples, int bone,
                   const RigidTransform& pose, const PartialPose& placed, std::span<const double> at_stake) {
  double nats = 0;
  for (int other = 0; other < int(placed.size()); ++other) {
    if (other == bone || !placed[other]) continue;
    const PairOverlap overlap = OverlapOf(anatomy, bone, pose, other, *placed[other]);
    const double claimed =
        2 * (overlap.of_a * independent_samples[bone] + overlap.of_b * independent_samples[other]);
    nats -= at_stake.empty() ? claimed : std::min(claimed, at_stake[other]);
  }
  return nats;
}

}  // namespace kvx
