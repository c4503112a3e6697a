// Interpolation over pose space: how much of each example every
// bone's neighbourhood takes at given joint angles.
#pragma once
#include "pipeline/examples/example_moments.h"
#include "pipeline/examples/joint_relevance.h"
#include "pipeline/skeleton/fit_skeleton.h"

namespace kvx {

enum class PoseBasis {
  kRbf,        // covariances of displacements: grows from the template, averages the scans' own noise
  kNormalised  // shares of all examples, the template among them, that sum to 1
};
PoseBasis PoseBasisFromName(const std::string& name);  // "rbf", "normalised"; throws InputError

struct PoseSpaceOptions {
  PoseBasis basis = PoseBasis::kRbf;
  // All bones look at all angles alike; otherwise each at those that move the tissue near it
  bool global = false;
};

// Radial basis functions per bone in the space of joint angles. The template is an example with no
// displacement, so rows need not sum to 1. Exact: at scan k's angles every bone's coefficients are the k-th
// unit vector, at the template all are 0. Scans whose angles bones do not tell apart are one example, their
// mean; a repeat of the template is the template, and adds nothing. Which joints matter near a bone is
// learned from `moments`; without them it is the bone's own joint and its neighbours'.
class PoseSpace {
 public:
  PoseSpace() = default;
  explicit PoseSpace(const SkeletonFit& fit, const PoseSpaceOptions& options = {},
                     const ExampleMoments& moments = {});
  // As if there were one more scan, at these angles; what was learned stays.
  PoseSpace With(const JointAngles& scan) const;

  // bones x scans
  Eigen::MatrixXd Coefficients(const JointAngles& angles) const;
  // Of the other scans near `bone` at the angles of `scan`, whose own is 0: what is most likely there without
  // it. `known`, 0 .. 1: how well each scan is known there.
  Eigen::VectorXd CoefficientsOfOthers(int bone, int scan, const Eigen::VectorXd& known) const;
  // How far outside the examples, per bone: 0 inside their range, 1 = one typical example distance beyond.
  Eigen::VectorXd Extrapolation(const JointAngles& angles) const;
  // Standard deviation of the displacement that is expected at this pose, per bone, relative to the scans'
  // root mean square near it: 0 at an example, above 1 far beyond them. Without scans, relative to what is
  // usual of a joint that is bent by 35 degrees.
  Eigen::VectorXd Uncertainty(const JointAngles& angles) const;

 private:
  struct BoneSpace {
    Variances variances;
    Eigen::MatrixXd covariances;  // of the examples
    Eigen::MatrixXd precision;    // its inverse
    std::vector<int> dofs;        // angles nearby: its range of examples, and all that shares look at
    Eigen::MatrixXd centres;      // distinct examples there (template first) x dofs
    double radius = 1;            // typical distance between them
    Eigen::MatrixXd of_shares;    // maps shares of `centres` to scan coefficients
  };
  void Solve();
  Eigen::MatrixXd Covariances(const Eigen::RowVectorXd& at) const;

  Skeleton skeleton_;
  PoseRows range_;        // angles of the scans, the template's where a scan's mean nothing
  PoseRows scans_;        // angles of the scans, held to that range as those that are asked for are
  double round_rad_ = 0;  // within which a scan's own part has no corner
  std::vector<BoneSpace> spaces_;
  PoseBasis basis_ = PoseBasis::kRbf;
};

}  // namespace kvx
