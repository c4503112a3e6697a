// What speaks for or against a pose beside the intensities: joints stay together, bones do not run through
// each other. All in nats, so that it adds up with EvidenceNats.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "pipeline/bones/template/bone_shape.h"

namespace kvx {

// Poses of the bones placed so far; index as in BoneSet.
using PartialPose = std::vector<std::optional<RigidTransform>>;

// How far a joint was turned and pulled apart. Heavy tails: a patella glides, carpal bones shift.
struct JointState {
  double rotation_rad = 0;  // of the child relative to the parent
  double twist_rad = 0;     // part of it about an elongated child's long axis
  double shift_mm = 0;      // of the joint: smallest displacement of its pivots
};
JointState JointStateOf(const BoneShape& child, const JointShape& joint, const RigidTransform& parent,
                        const RigidTransform& child_pose);
// <= 0. The best that a pose within `slack_mm` of this one may have.
double JointNats(const JointState& state, const BoneShape& child, double slack_mm = 0);
double RootNats(const RigidTransform& scan_from_template);  // <= 0: scans are taken much alike
double GapChangeMm(const BoneShape& child, const BoneShape& parent, const JointShape& joint,
                   const RigidTransform& parent_from_child);
double GapNats(double gap_change_mm, const BoneShape& child, double voxel_mm);  // <= 0

// Largest part of the bone, or of another one in it, that two bones claim; 0 where none overlap.
double WorstOverlap(const Anatomy& anatomy, int bone, const RigidTransform& pose, const PartialPose& placed);
// Twice the evidence that the claimed part could give at best. `at_stake`: none, or by bone what a claim on
// its place costs at most.
double OverlapNats(const Anatomy& anatomy, const std::vector<double>& independent_samples, int bone,
                   const RigidTransform& pose, const PartialPose& placed,
                   std::span<const double> at_stake = {});

}  // namespace kvx
