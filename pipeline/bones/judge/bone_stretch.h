// In which directions a scan shows a bone longer than the template does, or shorter.
#pragma once
#include <optional>

#include "core/rigid_transform.h"
#include "pipeline/bones/template/bone_tissue.h"

namespace kvx {

struct BoneStretch {
  // Lengths in the scan of those in the template, symmetric (the right stretch tensor), template frame.
  Eigen::Matrix3d scan_of_template;
  // Of its elements xx, yy, zz, xy, yz, zx. Noise in the images' slopes is taken for signal: where it is
  // strong, deviations are up to three times as large as stated.
  Eigen::Matrix<double, 6, 6> covariance;
};
// Standard deviation of the stretch along a unit vector.
double SdAlong(const BoneStretch& stretch, const Eigen::Vector3d& axis);

// By Gauss-Newton from the pose as it was found, which may turn and shift with it. Nothing where the scan
// shows less than half of the bone. `scan` in the contrast of `template_image`, which `tissue` was sampled
// from. Both are looked at as if their voxels were alike: ends of bones that are blurred more seem to lie
// farther in.
std::optional<BoneStretch> StretchOf(const BoneTissue& tissue, const CubicImage& template_image,
                                     const CubicImage& scan, const RigidTransform& scan_from_template);

}  // namespace kvx
