// First axes that the scans show, then those of their neighbours, then the others; second and third axes
// last.
#include "pipeline/skeleton/axis_signs.h"

#include <optional>

#include "core/joint_values.h"
#include "pipeline/skeleton/joint_angles.h"
#include "pipeline/skeleton/joint_axes.h"

namespace kvx {
namespace {

void Align(const Eigen::Vector3d& with, Eigen::Ref<Eigen::Vector3d> axis) {
  if (axis.dot(with) < 0) axis = -axis;
}

// For each turn 1 or -1, as its angle is on average; none where no scan turns far enough to tell.
std::vector<std::optional<int>> SignsOf(std::span<const RelativeMotion> motions, const Eigen::Matrix3d& axes,
                                        int turns) {
  const std::vector<Eigen::Vector3d> about = {axes.col(0), axes.col(1), axes.col(2)};
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(turns), most = mean;
  for (const RelativeMotion& m : motions) {
    const Eigen::VectorXd angles = AnglesOf(std::span(about).first(size_t(turns)), m.motion.rotation);
    mean += m.weight * angles;
    most = most.cwiseMax(angles.cwiseAbs());
  }
  std::vector<std::optional<int>> signs(size_t(turns), std::nullopt);
  for (int d = 0; d < turns; ++d)
    if (most[d] >= kShownTurnRad) signs[size_t(d)] = mean[d] < 0 ? -1 : 1;
  return signs;
}

// Along the axis of the box that is nearest to it.
void AlignWithBox(const OrientedBox& box, Eigen::Ref<Eigen::Vector3d> axis) {
  Eigen::Index nearest;
  (box.axes.transpose() * axis).cwiseAbs().maxCoeff(&nearest);
  Align(box.axes.col(nearest), axis);
}

class Orienting {
 public:
  Orienting(const BoneSet& bones, const std::vector<JointPlan>& plans,
            const std::vector<std::vector<RelativeMotion>>& motions, std::vector<FittedAxes>& joints)
      : bones_(bones), joints_(joints), neighbours_(ParallelNeighbours(bones, plans)), known_(plans.size()) {
    for (size_t b = 0; b < plans.size(); ++b)
      signs_.push_back(SignsOf(motions[b], joints[b].axes, TurnsAmong(plans[b].dofs.size())));
  }

  void OrientFirst() {
    for (size_t b = 0; b < joints_.size(); ++b) {
      if (signs_[b].empty() || !signs_[b][0]) continue;
      joints_[b].axes.col(0) *= *signs_[b][0];
      known_[b] = true;
    }
    Spread();
    for (size_t b = 0; b < joints_.size(); ++b) {
      if (known_[b] || signs_[b].empty()) continue;
      AlignWithBox(bones_.bones[b].box, joints_[b].axes.col(0));
      known_[b] = true;
      Spread();
    }
  }

  void OrientOthers() {
    for (size_t b = 0; b < joints_.size(); ++b) {
      Eigen::Matrix3d& axes = joints_[b].axes;
      for (size_t d = 1; d < signs_[b].size(); ++d) {
        if (signs_[b][d])
          axes.col(Eigen::Index(d)) *= *signs_[b][d];
        else if (d == 1)
          Align(SecondFromBox(axes.col(0), bones_.bones[b].box), axes.col(1));
        else
          Align(axes.col(0).cross(axes.col(1)), axes.col(2));
      }
    }
  }

 private:
  // From joints of known direction to those near parallel to them, on and on.
  void Spread() {
    bool more = true;
    while (more) {
      more = false;
      for (size_t b = 0; b < joints_.size(); ++b) {
        for (const int n : neighbours_[b]) {
          if (known_[b] || !known_[size_t(n)]) continue;
          Align(joints_[size_t(n)].axes.col(0), joints_[b].axes.col(0));
          known_[b] = more = true;
        }
      }
    }
  }

  const BoneSet& bones_;
  std::vector<FittedAxes>& joints_;
  std::vector<std::vector<int>> neighbours_;
  std::vector<bool> known_;                             // which way the first axis points
  std::vector<std::vector<std::optional<int>>> signs_;  // that the scans show
};

}  // namespace

void OrientAxes(const BoneSet& bones, const std::vector<JointPlan>& plans,
                const std::vector<std::vector<RelativeMotion>>& motions, std::vector<FittedAxes>& joints) {
  Orienting orienting(bones, plans, motions, joints);
  orienting.OrientFirst();
  orienting.OrientOthers();
}

}  // namespace kvx
