// Two normal distributions of one small motion about the bone's centroid.
#include "pipeline/bones/refine/pose_hint.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "core/local_motion.h"
#include "core/voxels/to_corner.h"
#include "pipeline/bones/template/bone_shape.h"

namespace kvx {
namespace {

constexpr double kReachOfThickness = 0.5;
constexpr double kFarthest = 1.5;             // of the way across all bones
constexpr double kHintRad = RadFromDeg(5);    // as well as bones are aligned by eye
constexpr double kHintOfThickness = 1.0 / 6;  // the reach is three standard deviations

Twist6Covariance CovarianceOfHint(const Bone& bone) {
  const double shift_mm = kHintOfThickness * bone.box.extent_mm.minCoeff();
  Twist6Covariance out = Twist6Covariance::Zero();
  out.diagonal().head<3>().setConstant(kHintRad * kHintRad);
  out.diagonal().tail<3>().setConstant(shift_mm * shift_mm);
  return out;
}

// Across all bones of the template, from corner to corner.
double AcrossMm(const BoneSet& bones) {
  Eigen::AlignedBox3d all;
  for (const Bone& bone : bones.bones) {
    for (int n = 0; n < 8; ++n) {
      const Eigen::Vector3d part = ToCorner(n).cast<double>() - Eigen::Vector3d(0, 0.5, 0.5);
      all.extend(bone.box.origin.lps + bone.box.axes * part.cwiseProduct(bone.box.extent_mm));
    }
  }
  return all.diagonal().norm();
}

double BeyondMm(const PointMm& place, const Grid& grid) {
  return (grid.ToMm(grid.Nearest(grid.ToVox(place))).lps - place.lps).norm();
}

}  // namespace

bool MayBeMeant(const BoneSet& bones, const RigidTransform& hint, int bone, const Grid& scan) {
  return BeyondMm(hint * bones.bones[size_t(bone)].centroid, scan) <= kFarthest * AcrossMm(bones);
}

bool IsNearHint(const Bone& bone, const RigidTransform& hint, const RigidTransform& pose) {
  return PoseDistanceMm(bone, hint, pose) < kReachOfThickness * bone.box.extent_mm.minCoeff();
}

// With the fit's covariance S and the hint's P: the part S (S + P)^-1 of the way, and S (S + P)^-1 P left.
void WeighHint(const Bone& bone, const RigidTransform& hint, BoneFit& fit) {
  if (!IsNearHint(bone, hint, fit.scan_from_template)) return;
  const Twist way = LocalMotion(fit.scan_from_template, hint, bone.centroid);
  const Twist6Covariance of_hint = CovarianceOfHint(bone);
  const Twist6Covariance both = fit.covariance + of_hint;
  const Twist6Covariance part = both.ldlt().solve(fit.covariance).transpose();  // both are symmetric
  fit.scan_from_template = MovedLocally(fit.scan_from_template, part * way, bone.centroid);
  const Twist6Covariance left = part * of_hint;
  fit.covariance = 0.5 * (left + left.transpose());
}

}  // namespace kvx
