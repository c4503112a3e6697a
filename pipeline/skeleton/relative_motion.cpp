// From two fits to one motion.
#include "pipeline/skeleton/relative_motion.h"

namespace kvx {

// With small turns c of the child and p of the parent, (R_p Exp(p))^-1 R_c Exp(c) = R Exp(c - R^T p).
RelativeMotion MotionOf(const BoneFit& parent, const BoneFit& child, double weight) {
  RelativeMotion out{parent.scan_from_template.Inverse() * child.scan_from_template, weight};
  const Eigen::Matrix3d r = out.motion.rotation.toRotationMatrix();
  out.turn_spread =
      child.covariance.topLeftCorner<3, 3>() + r.transpose() * parent.covariance.topLeftCorner<3, 3>() * r;
  return out;
}

}  // namespace kvx
