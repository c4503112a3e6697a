// Linear blending of bone motions, and the dual-quaternion blend into which it fades where it degenerates.
#include "core/blend.h"

namespace kvx {
namespace {

AffineMap FromRigid(const RigidTransform& t) {
  AffineMap m;
  m << t.rotation.toRotationMatrix(), t.translation_mm;
  return m;
}

// Kavan et al. 2008: weighted sum of unit dual quaternions on one hemisphere, normalised.
AffineMap DualQuaternionBlend(const VoxelWeights& weights, const PoseVector& pose) {
  Eigen::Vector4d real = Eigen::Vector4d::Zero(), dual = Eigen::Vector4d::Zero();
  const Eigen::Vector4d pivot = pose[weights.bones[0]].rotation.coeffs();
  for (int s = 0; s < kBonesPerVoxel; ++s) {
    const RigidTransform& t = pose[weights.bones[s]];
    const Eigen::Quaterniond half(0, 0.5 * t.translation_mm.x(), 0.5 * t.translation_mm.y(),
                                  0.5 * t.translation_mm.z());
    const double sign = pivot.dot(t.rotation.coeffs()) < 0 ? -1.0 : 1.0;
    real += sign * weights.weights[s] * t.rotation.coeffs();
    dual += sign * weights.weights[s] * (half * t.rotation).coeffs();
  }
  const double norm = real.norm();
  if (norm < 1e-6) return FromRigid(pose[weights.bones[0]]);
  const Eigen::Quaterniond q(Eigen::Vector4d(real / norm)), d(Eigen::Vector4d(dual / norm));
  return FromRigid({q, 2.0 * (d * q.conjugate()).vec()});
}

}  // namespace

AffineMap Blend(const VoxelWeights& weights, const PoseVector& scan_from_template) {
  if (weights.weights[1] == 0.0f) return FromRigid(scan_from_template[weights.bones[0]]);
  AffineMap sum = AffineMap::Zero();
  for (int s = 0; s < kBonesPerVoxel; ++s) {
    if (weights.weights[s] == 0.0f) continue;
    sum += double(weights.weights[s]) * FromRigid(scan_from_template[weights.bones[s]]);
  }
  const double linear = LinearShare(sum.leftCols<3>().determinant());
  if (linear == 1) return sum;
  return linear * sum + (1 - linear) * DualQuaternionBlend(weights, scan_from_template);
}

}  // namespace kvx
