// What the search knows of each bone's shape and of the joints between bones, all in template world.
#pragma once
#include <vector>

#include "core/bone.h"
#include "core/rigid_transform.h"

namespace kvx {

struct BodyPoint {
  Eigen::Vector3d at_mm;
  double depth_mm;  // below the surface
};

struct BoneShape {
  Eigen::Vector3d centroid_mm;
  Eigen::Matrix3d axes;  // of the box; column 0 long
  Eigen::Vector3d extent_mm;
  double thickness_mm = 0, length_mm = 0;   // smallest and largest extent
  Volume distance_mm;                       // signed, about the bone
  std::vector<BodyPoint> body;              // a few hundred points inside
  std::vector<Eigen::Vector3d> surface_mm;  // a few hundred voxel centres at the surface

  bool Elongated() const { return length_mm > 1.6 * thickness_mm; }
};

// Where a bone touches its parent, and what may be the centre of its joint.
struct JointShape {
  double gap_mm = 0;  // between the surfaces in the template
  std::vector<Eigen::Vector3d>
      pivots_mm;                // the contact, and the centres of the balls inscribed at both sides of it
  std::vector<int> neighbours;  // bones close by, nearest first, the parent not among them
};

struct Anatomy {
  std::vector<BoneShape> bones;  // index as in BoneSet
  std::vector<JointShape> joints;
  double voxel_mm = 1;
};

Anatomy StudyShapes(const BoneSet& bones, double distance_margin_mm);

// Signed distance to a bone's surface in the template; large where it is far away.
double DistanceMm(const BoneShape& bone, const Eigen::Vector3d& x_in_template);
// Smallest distance of a's surface to b where template_b_from_template_a = b_pose^-1 a_pose.
double GapMm(const BoneShape& a, const BoneShape& b, const RigidTransform& b_from_a);
// Part of a's body that lies in b, deeper than `tolerance_mm` in both.
double OverlapFraction(const BoneShape& a, const BoneShape& b, const RigidTransform& b_from_a,
                       double tolerance_mm);
// A pose of the bone as a place in twelve dimensions: distances there are root mean squares, in mm, of how
// far the bone's ends and sides lie apart.
using PoseMark = Eigen::Matrix<double, 12, 1>;
PoseMark MarkOf(const BoneShape& bone, const RigidTransform& pose);
double PoseDistanceMm(const BoneShape& bone, const RigidTransform& a, const RigidTransform& b);
double PoseDistanceMm(const Bone& bone, const RigidTransform& a, const RigidTransform& b);

}  // namespace kvx
