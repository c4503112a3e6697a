// The biharmonic clamped plate spline (paper, section 4.2):
// smooth inside the unit ball, zero in value and slope on it.
#pragma once
#include <array>

#include "core/frames.h"

namespace kvx {

// Green's function G(x, y) of the clamped biharmonic problem in the unit ball, in a form without
// cancellation: q = sqrt(|x|^2 |y|^2 - 2 x.y + 1), G = (q - |x - y|)^2 / q.
// Zero when either point is outside the ball.
double ClampedPlateGreen(const Eigen::Vector3d& x, const Eigen::Vector3d& y);

constexpr int kControlPoints = 8;  // 2 x 2 x 2 per block, as the paper allocates them
using ControlRow = Eigen::Matrix<double, 1, kControlPoints>;
using ControlMatrix = Eigen::Matrix<double, kControlPoints, kControlPoints>;

// The spline of one block: eight control points inside the corners of the centre block, support the ball
// inscribed in the 3 x 3 x 3 blocks around it. Coordinates are p = (y - block centre) / (1.5 block widths).
class BlockSpline {
 public:
  // `inset`: distance of the control points from the block's faces, in block widths;
  // any of 0.05..0.3 conditions G well.
  explicit BlockSpline(double inset = 0.15);

  const std::array<Eigen::Vector3d, kControlPoints>& control_points() const { return points_; }
  // u(p) = Basis(p) * F, F the displacements (8 x 3) of the control points.
  ControlRow Basis(const Eigen::Vector3d& p) const;
  // Integral of |laplacian u|^2 over the ball = trace(F^T BendingEnergy() F), in the ball's coordinates. For
  // a ball of radius R the integral over space is that divided by R.
  ControlMatrix BendingEnergy() const;
  // G(c, c) at a control point: the same for all eight by symmetry.
  double SelfEnergy() const;

 private:
  std::array<Eigen::Vector3d, kControlPoints> points_;
  ControlMatrix inverse_;  // of G at the control points
};

}  // namespace kvx
