// Eq. 2 at many voxels: Blend() of core/blend.h with the bones' matrices made once.
#pragma once
#include "core/blend.h"

namespace kvx {

class BlendTable {
 public:
  explicit BlendTable(const PoseVector& scan_from_template);

  AffineMap operator()(const VoxelWeights& weights) const;  // equals Blend(weights, pose)

 private:
  const PoseVector& pose_;
  std::vector<AffineMap> matrices_;
};

}  // namespace kvx
