// Interpolation over pose space: how much of each example every bone's neighbourhood takes at given joint angles.
#pragma once
#include "pipeline/skeleton/fit_skeleton.h"

namespace kvx {

// Radial basis functions per bone in the space of its own neighbouring joints' angles. The template is an example with no
// displacement, so rows need not sum to 1. Exact: at scan k's angles every bone's coefficients are the k-th unit vector.
class PoseSpace {
 public:
  PoseSpace() = default;
  explicit PoseSpace(const SkeletonFit& fit);

  // bones x scans
  Eigen::MatrixXd Coefficients(const JointAngles& angles) const;
  // How far outside the examples, per bone: 0 inside their range, 1 = one typical example distance beyond.
  Eigen::VectorXd Extrapolation(const JointAngles& angles) const;

 private:
  struct BoneSpace {
    std::vector<int> dofs;          // positions in JointAngles that this bone looks at
    Eigen::MatrixXd centres;        // examples (template first) x dofs
    Eigen::MatrixXd solution;       // maps basis values to scan coefficients
    double radius = 1;
  };
  std::vector<BoneSpace> spaces_;
  int scans_ = 0;
};

}  // namespace kvx
