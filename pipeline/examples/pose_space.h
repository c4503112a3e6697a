// Interpolation over pose space: how much of each example every
// bone's neighbourhood takes at given joint angles.
#pragma once
#include "pipeline/skeleton/fit_skeleton.h"

namespace kvx {

enum class PoseBasis {
  kRbf,        // covariances of displacements: grows from the template, averages the scans' own noise
  kNormalised  // shares of all examples, the template among them, that sum to 1
};
PoseBasis PoseBasisFromName(const std::string& name);  // "rbf", "normalised"; throws InputError

struct PoseSpaceOptions {
  PoseBasis basis = PoseBasis::kRbf;
  bool global = false;  // every bone looks at all angles; false: at its own and its neighbours' joints
};

// Radial basis functions per bone in the space of joint angles. The template is an example with no
// displacement, so rows need not sum to 1. Exact: at scan k's angles every bone's coefficients are the k-th
// unit vector, at the template all are 0.
class PoseSpace {
 public:
  PoseSpace() = default;
  explicit PoseSpace(const SkeletonFit& fit, const PoseSpaceOptions& options = {});

  // bones x scans
  Eigen::MatrixXd Coefficients(const JointAngles& angles) const;
  // How far outside the examples, per bone: 0 inside their range, 1 = one typical example distance beyond.
  Eigen::VectorXd Extrapolation(const JointAngles& angles) const;
  // How little the examples say about this pose, per bone: 0 at an example, towards 1 where they say nothing.
  Eigen::VectorXd Uncertainty(const JointAngles& angles) const;

 private:
  struct BoneSpace {
    std::vector<int> dofs;                 // positions in JointAngles that this bone looks at
    std::vector<std::vector<int>> joints;  // positions in `dofs`, by joint
    Eigen::MatrixXd centres;               // examples (template first) x dofs
    Eigen::MatrixXd solution;              // maps basis values to scan coefficients
    Eigen::MatrixXd precision;             // inverse of the examples' covariances
    double radius = 1;
  };
  Eigen::VectorXd BasisAt(const BoneSpace& space, const Eigen::RowVectorXd& at) const;

  std::vector<BoneSpace> spaces_;
  PoseBasis basis_ = PoseBasis::kRbf;
  int scans_ = 0;
};

}  // namespace kvx
