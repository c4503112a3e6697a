// Gauss-Newton steps of mutual information (paper, eq. 5) between scans of different contrast.
#pragma once
#include <span>
#include <vector>

#include "kernels/block_level.h"

namespace kvx {

// Per voxel; squares of these weights have its slope and, on average, its curvature.
struct GreyTargets {
  std::vector<float> greys, weights;
};

class InformationTargets {
 public:
  explicit InformationTargets(const BlockLevel& level) : level_(level) {}

  // On the finest level, where the contrast is another one.
  bool Apply() const { return level_.template_voxels == 1 && !level_.own_greys.empty(); }
  // `seen`: as BlockKernels::Seen gives it.
  GreyTargets Of(std::span<const float> seen) const;

 private:
  const BlockLevel& level_;
};

}  // namespace kvx
