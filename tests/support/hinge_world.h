// Two bones and a hinge in closed form: a textured bar on an oblique anisotropic grid, weights that blend
// over the joint.
#pragma once
#include "core/blend.h"
#include "core/scan.h"
#include "pipeline/posing/posing_engine.h"

namespace kvx::testing_support {

struct HingeWorld {
  explicit HingeWorld(const Eigen::Vector3i& size = {26, 30, 48});

  PoseVector Bent(double angle_rad) const;  // the outer bone turned about the hinge
  // A smooth displacement inside the bar, mm, zero in the bones' cores.
  DisplacementField Bulge(double amplitude_mm) const;
  double TextureAt(const PointMm& x) const;          // smooth, band-limited: about 10 voxels a period
  ResolvedPose Posed(const PoseVector& pose) const;  // no examples
  PosingInputs Inputs(std::vector<const DisplacementField*> examples = {}) const;
  // The middle of the bar: clear of its surface by `inset_mm`.
  bool DeepInside(const PointMm& x, double inset_mm) const;

  Scan scan;
  Mask body;
  BoneSet bones;
  WeightMap weights;
  PointMm hinge;
  Eigen::Vector3d along, across;  // unit: the bar's long axis, the hinge's axis
  double half_width_mm = 8, half_length_mm = 20, blend_mm = 6;
  static constexpr float kAir = -50.0f;
};

}  // namespace kvx::testing_support
