// Oriented bounding boxes of bones (paper, section 3.1).
#pragma once
#include "core/bone.h"

namespace kvx {

// What says how a box lies where the bone's shape does not: round bones, discs and balls. Template world.
struct BoxGuide {
  PointMm towards_parent;                            // the base is the end nearer to it
  Eigen::Vector3d along = Eigen::Vector3d::Zero();   // the parent's long axis, unit; 0 where there is none
  Eigen::Vector3d across = Eigen::Vector3d::Zero();  // the parent's second axis; of a root, from its first
                                                     // child to its last; any length, 0 where there is none
};

// Box of the voxels of `label`. Its axes are the principal ones, and move on steadily to the guide's as these
// get alike, so that noise in a label map never turns a box round. Throws InputError where there is no voxel.
OrientedBox FitOrientedBox(const LabelMap& labels, int label, const BoxGuide& guide);

}  // namespace kvx
