// Linear blending from a table of matrices; the guard is core's.
#include "pipeline/registration/region/blend_table.h"

namespace kvx {

BlendTable::BlendTable(const PoseVector& scan_from_template) : pose_(scan_from_template) {
  for (const RigidTransform& t : pose_) {
    matrices_.emplace_back();
    matrices_.back() << t.rotation.toRotationMatrix(), t.translation_mm;
  }
}

AffineMap BlendTable::operator()(const VoxelWeights& weights) const {
  if (weights.weights[1] == 0.0f) return matrices_[weights.bones[0]];
  AffineMap sum = AffineMap::Zero();
  for (int s = 0; s < kBonesPerVoxel; ++s) {
    if (weights.weights[s] != 0.0f) sum += double(weights.weights[s]) * matrices_[weights.bones[s]];
  }
  return sum.leftCols<3>().determinant() >= kRegularDeterminant ? sum : Blend(weights, pose_);
}

}  // namespace kvx
