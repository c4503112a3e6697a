// Sampled signed distances of the bones with their cartilage, once per anatomy: what "inside a bone"
// means to mechanics, rendering and truth alike.
#pragma once
#include <functional>
#include <vector>

#include "pipeline/phantom/anatomy/anatomy.h"

namespace kvx::phantom {

// One bone's distance on a grid around it, interpolated trilinearly.
struct DistanceGrid {
  Box box;
  double step_mm = 1;
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  std::vector<float> values;

  // Outside the grid: `kFarMm`.
  double At(const Eigen::Vector3d& x) const;
};

constexpr double kBoneMarginMm = 8;  // of the grids around the bones: further away, distance reads kFarMm
constexpr double kFarMm = 1e3;

struct NearestBone {
  int bone = -1;  // -1: none within the margin
  double distance_mm = kFarMm;
};

// Any distance, sampled over `box`.
DistanceGrid SampleDistance(const Box& box, double step_mm,
                            const std::function<double(const Eigen::Vector3d&)>& distance);

class BoneFields {
 public:
  explicit BoneFields(const Anatomy& anatomy);
  int size() const { return int(grids_.size()); }
  double Distance(int bone, const Eigen::Vector3d& x) const { return grids_[bone].At(x); }
  const DistanceGrid& grid(int bone) const { return grids_[bone]; }
  NearestBone Nearest(const Eigen::Vector3d& x) const;

 private:
  std::vector<DistanceGrid> grids_;
};

}  // namespace kvx::phantom
