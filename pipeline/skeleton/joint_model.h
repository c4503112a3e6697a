// Joints as every scan of a study shows them: centre, axes, and how far scans stray from them. Fitted to all
// scans at once; each scan's bones then lie where its own evidence and the joints agree best.
#pragma once
#include "core/pose.h"
#include "pipeline/skeleton/joint_centre.h"
#include "pipeline/skeleton/joint_plan.h"
#include "pipeline/skeleton/relative_motion.h"

namespace kvx {

// Of the joint of one bone. Without `known` (root, dependent bones, too few scans) it says nothing.
struct JointModel {
  bool known = false;
  PointMm centre;                                         // template
  std::vector<Eigen::Vector3d> axes;                      // as Joint::dofs
  Eigen::Matrix3d axis_spread = Eigen::Matrix3d::Zero();  // covariance of a small turn of all axes (rad^2)
  double stray_rad = 0;                                   // standard deviation across the axes, per direction
  double stray_mm = 0;                                    // of the centre, per direction
};

// All bones of all scans. Poses and covariances start as measured and end as settled; these hold what is not
// known of the axes, too.
class SettledPoses {
 public:
  SettledPoses(const BoneSet& bones, const std::vector<JointPlan>& plans,
               const std::vector<const BoneFits*>& measured);

  const std::vector<JointModel>& joints() const { return joints_; }
  const BoneFits& Scan(size_t k) const { return settled_[k]; }
  // How many standard deviations a bone's joint strays in a scan from what the other scans lead to expect;
  // 0 where the joint is not known.
  double Oddness(size_t scan, int bone) const;

 private:
  struct Stray;  // of one joint in one scan
  Stray StrayOf(const BoneFits& scan, int bone) const;
  bool Applies(const BoneFits& scan, int bone) const;
  struct Equations;  // that put one scan's bones right
  void AddMeasured(size_t k, Equations& out) const;
  void AddJoints(size_t k, Equations& out) const;
  Eigen::VectorXd CertaintyOf(size_t k, int bone, const Stray& stray) const;
  struct Settled;  // of a joint in a scan
  Settled SettledStray(size_t k, int bone) const;
  // Sums over scans, and of how many observations.
  struct Squares {
    double turn = 0, shift = 0, turns = 0, shifts = 0;
  };
  Squares ExpectedSquares(int bone);
  void FitJoints();
  void SettleScan(size_t k);
  Eigen::Matrix<double, 12, 12> SpreadOfPair(size_t k, int bone) const;
  RelativeMotion WithoutJoint(size_t k, int bone) const;
  bool MeasureStray();
  void AddAxisSpread(size_t k);

  const BoneSet& bones_;
  const std::vector<JointPlan>& plans_;
  const std::vector<const BoneFits*>& measured_;
  std::vector<CentreBelief> usual_centres_;
  std::vector<JointModel> joints_;
  std::vector<BoneFits> settled_;
  std::vector<Eigen::MatrixXd> covariance_;  // per scan, of all bones
  // Per scan and bone: how it moves by all that is known of it and its parent but their joint.
  std::vector<std::vector<RelativeMotion>> without_joint_;
  std::vector<std::vector<double>> trust_;  // per scan and bone: 1 where the joint strays as usual
};

}  // namespace kvx
