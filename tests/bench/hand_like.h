// A body like a hand for benchmarks: a palm and five straight fingers of four bones each, separated by air;
// weights blend over 5 mm at every joint.
#pragma once
#include "pipeline/posing/posing_engine.h"

namespace kvx {

struct HandShape {
  double scale = 1;  // of voxels along each axis
  int examples = 10;
  int fingers = 5;  // others are air
};

struct HandLike {
  static constexpr int kFingers = 5, kBonesPerFinger = 4;

  explicit HandLike(const HandShape& shape = {});
  ResolvedPose Pose(double bend_rad) const;
  PosingInputs Inputs() const;

  Grid grid;
  Scan scan;
  Mask body;
  BoneSet bones;
  WeightMap weights;
  std::vector<DisplacementField> examples;

 private:
  void Voxel(size_t v, const Eigen::Vector3d& x, int fingers);
};

}  // namespace kvx
