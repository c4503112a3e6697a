// About which axes a joint turns, from the motions of its child relative to its parent.
#pragma once
#include <span>
#include <vector>

#include "core/bone.h"
#include "pipeline/skeleton/relative_motion.h"

namespace kvx {

constexpr double kShownTurnRad = RadFromDeg(5);  // a smaller turn is within what bones are found to

struct AxisBelief {
  Eigen::Vector3d axis;  // unit; its sign says nothing
  double spread_rad;
};
struct JointKnowledge {
  std::vector<AxisBelief> near;    // where the first axis lies
  bool conjunct_rotation = false;  // the bone may turn about its length as it bends
};

// What a second axis is where the scans do not show one: across the bone and the first axis; where the bone
// lies along that axis, across its width.
Eigen::Vector3d SecondFromBox(const Eigen::Vector3d& first, const OrientedBox& box);

// Orthogonal axes (columns): the dominant axis of rotation, the dominant one across it, and their cross
// product. Where the motion is too small to decide, those of the bone's box: across its width, across its
// thickness, along it. Scans count by how well they know a turn, and a long bone is taken to turn across its
// length unless they show otherwise. The first `dof_count` of them, of two that the scans show, are then
// turned together to explain the rotations best as an ordered product. With beliefs about the first axis, it
// is the one near them, whether or not it is dominant. With conjunct rotation, the first axis is that of
// bending alone, and of three the last lies along the bone: a long bone may at the same time turn about its
// length, in proportion (the knee's screw home; two fixed axes after Hollister et al. 1993, "The axes of
// rotation of the knee"). One axis for both would lie between them.
Eigen::Matrix3d FitAxes(std::span<const RelativeMotion> motions, const OrientedBox& box, int dof_count,
                        const JointKnowledge& known = {});

// How well each of fitted axes is known: variance of its tilt, per direction across it (rad^2); infinite of
// axes that the motions say nothing of, as of three, which explain every rotation, or of a second one that
// they do not show.
Eigen::Vector3d AxisVariances(std::span<const RelativeMotion> motions, const OrientedBox& box, int dof_count,
                              const JointKnowledge& known, const Eigen::Matrix3d& axes);

}  // namespace kvx
