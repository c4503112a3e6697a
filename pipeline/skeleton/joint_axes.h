// About which axes a joint turns, from the motions of its child relative to its parent.
#pragma once
#include <optional>
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

// Whether some scan turns the joint far enough to say about which axis.
bool ShowsAnAxis(std::span<const RelativeMotion> motions);

// What a second axis is where the scans do not show one: across the bone and the first axis; where the bone
// lies along that axis, across its width.
Eigen::Vector3d SecondFromBox(const Eigen::Vector3d& first, const OrientedBox& box);

// Orthogonal axes (columns): the dominant axis of rotation, the dominant one across it, and their cross
// product. Where the motion is too small to decide, those of the bone's box: across its width, across its
// thickness, along it. Scans count by how well they know a turn, and a long bone is taken to turn across its
// length unless they show otherwise. The first `dof_count` of them, of two that the scans show, are then
// turned together to explain the rotations best as an ordered product. With beliefs about the first axis, it
// is the one near them, whether or not it is dominant: the best that is found from their mean and from
// `before`, axes that were fitted before. With conjunct rotation, the first axis is that of
// bending alone, and of three the last lies along the bone: a long bone may at the same time turn about its
// length, in proportion (the knee's screw home; two fixed axes after Hollister et al. 1993, "The axes of
// rotation of the knee"). One axis for both would lie between them.
Eigen::Matrix3d FitAxes(std::span<const RelativeMotion> motions, const OrientedBox& box, int dof_count,
                        const JointKnowledge& known = {}, const std::optional<Eigen::Matrix3d>& before = {});

// What says how well fitted axes are known.
struct AxisCertainty {
  // Of small turns of all axes together (rad^-2), from the motions and from what is usual of such joints, but
  // not from the beliefs. Zero where the axes are not fitted to the motions.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  int fitted = 0;  // axes that it tells of, of three none: they explain every rotation
  // Of the first axis (rad^2), beside what follows from the information: where all turns lie about one axis
  // of a joint that has two, turns about both may have gone together.
  double variance = 0;
};
AxisCertainty CertaintyOf(std::span<const RelativeMotion> motions, const OrientedBox& box, int dof_count,
                          const JointKnowledge& known, const Eigen::Matrix3d& axes);

// Of each axis the variance of its tilt, per direction across it (rad^2), from the covariance of small turns
// of all axes together (the information's inverse where neighbours say nothing); infinite of axes that it
// does not tell of.
Eigen::Vector3d AxisVariances(const AxisCertainty& certainty, const Eigen::Matrix3d& covariance,
                              const Eigen::Matrix3d& axes);

}  // namespace kvx
