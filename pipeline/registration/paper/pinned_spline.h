// The clamped plate spline of one block with points that must not move: bone voxels as fixed control points
// (paper, section 4.3).
#pragma once
#include <vector>

#include "core/clamped_plate_spline.h"

namespace kvx {

// Coordinates as BlockSpline's: the support is the unit ball. A control point that itself lies in bone is
// fixed.
class PinnedSpline {
 public:
  // `fixed`: candidates, in order; those too close to a free point or to each other are left out, and no more
  // than kMostFixed are used. `in_bone`: which of the eight control points lie in bone.
  PinnedSpline(const std::array<bool, kControlPoints>& in_bone, const std::vector<Eigen::Vector3d>& fixed);

  static constexpr int kMostFixed = 12;      // the paper's "less than 4 x 3"
  static constexpr double kLeastGap = 0.15;  // between points: closer ones make the system ill-conditioned

  int free_count() const { return int(free_.size()); }
  const std::vector<Eigen::Vector3d>& nodes() const { return nodes_; }  // free ones first
  // u(p) = Basis(p) * F, F the displacements (free_count x 3) of the free control points.
  Eigen::RowVectorXd Basis(const Eigen::Vector3d& p) const;

 private:
  std::vector<int> free_;  // which of the eight
  std::vector<Eigen::Vector3d> nodes_;
  Eigen::MatrixXd weights_;  // of the nodes' Green's functions, per free displacement
};

}  // namespace kvx
