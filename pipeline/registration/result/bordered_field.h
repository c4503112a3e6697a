// What a registration says of points between its voxels.
#pragma once
#include "core/bone.h"
#include "core/image.h"
#include "core/pose.h"

namespace kvx {

// v-hat = v + u(v), trilinear between the field's voxels, but that a bone moves as its own voxels do out to
// its border (core/bone_border.h). Refers to the field and the bones, which have the same grid.
class BorderedField {
 public:
  // `scan_from_template`: of every bone.
  BorderedField(const DisplacementField& field, const BoneSet& bones, PoseVector scan_from_template);

  const DisplacementField& field() const { return field_; }
  // Beyond the grid as at the nearest place of it.
  Eigen::Vector3d operator()(const PointMm& in_template) const;

 private:
  const DisplacementField& field_;
  const LabelMap& labels_;
  const std::vector<int> bone_of_label_;
  const PoseVector scan_from_template_;
};

}  // namespace kvx
