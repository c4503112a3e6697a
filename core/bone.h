// Bones of the template: names, tree and oriented bounding boxes (paper, section 3.1).
#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/image.h"

namespace kvx {

// Principal axes of the bone's voxels; origin at the centre of the box's base (the end towards the parent).
struct OrientedBox {
  PointMm origin;                                       // template world
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();   // columns, unit, right-handed; column 0 = long axis,
                                                        // from the base outwards
  Eigen::Vector3d extent_mm = Eigen::Vector3d::Zero();  // full lengths along the axes
};

constexpr int kNoParent = -1;

struct Bone {
  int label = 0;  // value in the label map, > 0
  std::string name;
  int parent = kNoParent;  // index into BoneSet::bones
  size_t voxels = 0;       // on the template grid
  PointMm centroid;        // template world
  OrientedBox box;
};

// What of a label map was not taken as it was given.
struct LabelMending {
  std::vector<int> unused_labels;  // of no bone
  // Taken from bones, given to them, and of their masks but another bone's, too: index as in BoneSet
  std::vector<size_t> stray_voxels, enclosed_voxels, shared_voxels;
};

// Parents come before children, so one pass walks the tree; the first bone is the root.
// Index = position in `bones`.
struct BoneSet {
  std::vector<Bone> bones;
  LabelMap labels;  // on the template grid
  LabelMending mending;

  int size() const { return int(bones.size()); }
  int IndexOf(std::string_view name) const;  // throws NotFound
  std::vector<int> ChildrenOf(int bone) const;
  std::map<int, std::string> NamesByLabel() const;
};

}  // namespace kvx
