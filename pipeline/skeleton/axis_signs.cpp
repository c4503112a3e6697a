// First axes, those of near parallel joints together; then second and third axes.
#include "pipeline/skeleton/axis_signs.h"

#include <algorithm>
#include <optional>

#include "core/joint_values.h"
#include "pipeline/skeleton/joint_angles.h"
#include "pipeline/skeleton/joint_axes.h"

namespace kvx {
namespace {

void Align(const Eigen::Vector3d& with, Eigen::Ref<Eigen::Vector3d> axis) {
  if (axis.dot(with) < 0) axis = -axis;
}

// For each turn the sum of its angles; none where no scan turns far enough to tell.
std::vector<std::optional<double>> SumsOf(std::span<const RelativeMotion> motions,
                                          const Eigen::Matrix3d& axes, int turns) {
  const std::vector<Eigen::Vector3d> about = {axes.col(0), axes.col(1), axes.col(2)};
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(turns), most = sum;
  for (const RelativeMotion& m : motions) {
    const Eigen::VectorXd angles = AnglesOf(std::span(about).first(size_t(turns)), m.motion.rotation);
    sum += m.weight * angles;
    most = most.cwiseMax(angles.cwiseAbs());
  }
  std::vector<std::optional<double>> sums(size_t(turns), std::nullopt);
  for (int d = 0; d < turns; ++d)
    if (most[d] >= kShownTurnRad) sums[size_t(d)] = sum[d];
  return sums;
}

// Along the axis of the box that is nearest to it, how far it points.
double NearestOfBox(const OrientedBox& box, const Eigen::Vector3d& axis) {
  const Eigen::Vector3d along = box.axes.transpose() * axis;
  Eigen::Index nearest;
  along.cwiseAbs().maxCoeff(&nearest);
  return along[nearest];
}

// A bone beside another says which way that one bends if it lies so far from the line along it, ...
constexpr double kAsideMm = 10.0;
constexpr double kAcross = 0.5;  // ... and the axis so nearly across both (cosine)

class Orienting {
 public:
  Orienting(const BoneSet& bones, const std::vector<JointPlan>& plans,
            const std::vector<std::vector<RelativeMotion>>& motions, std::vector<FittedAxes>& joints)
      : bones_(bones), plans_(plans), joints_(joints), neighbours_(ParallelNeighbours(bones, plans)) {
    for (size_t b = 0; b < plans.size(); ++b)
      sums_.push_back(SumsOf(motions[b], joints[b].axes, TurnsAmong(plans[b].dofs.size())));
  }

  void OrientFirst() {
    std::vector<bool> done(joints_.size(), false);
    for (size_t b = 0; b < joints_.size(); ++b) {
      if (done[b] || sums_[b].empty()) continue;
      const std::vector<size_t> group = AlignedGroup(b);
      OrientGroup(group);
      for (const size_t j : group) done[j] = true;
    }
  }

  void OrientOthers() {
    for (size_t b = 0; b < joints_.size(); ++b) {
      Eigen::Matrix3d& axes = joints_[b].axes;
      for (size_t d = 1; d < sums_[b].size(); ++d) {
        if (sums_[b][d])
          axes.col(Eigen::Index(d)) *= *sums_[b][d] < 0 ? -1 : 1;
        else if (d == 1)
          Align(SecondFromBox(axes.col(0), bones_.bones[b].box), axes.col(1));
        else
          Align(axes.col(0).cross(axes.col(1)), axes.col(2));
      }
    }
  }

 private:
  void TurnRound(size_t b) {
    joints_[b].axes.col(0) *= -1;
    if (sums_[b][0]) *sums_[b][0] *= -1;
  }

  // The joint and all that are near parallel to it by way of others, their first axes along each other.
  std::vector<size_t> AlignedGroup(size_t first) {
    std::vector<size_t> group{first};
    for (size_t g = 0; g < group.size(); ++g) {
      for (const ParallelJoint& neighbour : neighbours_[group[g]]) {
        const auto n = size_t(neighbour.bone);
        if (std::ranges::find(group, n) != group.end()) continue;
        if (joints_[n].axes.col(0).dot(joints_[group[g]].axes.col(0)) < 0) TurnRound(n);
        group.push_back(n);
      }
    }
    return group;
  }

  // Positive where the first axis points as the bones' shapes have it: away from a bone that follows this one
  // on the same parent, as a tibia bends away from the patella, else along the bone's box.
  double ByShape(size_t b) const {
    const Bone& bone = bones_.bones[b];
    const Eigen::Vector3d axis = joints_[b].axes.col(0);
    for (size_t f = 0; f < plans_.size(); ++f) {
      const Bone& follower = bones_.bones[f];
      if (plans_[f].driver != bone.name || follower.parent != bone.parent) continue;
      const Eigen::Vector3d away = (follower.centroid.lps - bone.box.origin.lps).cross(bone.box.axes.col(0));
      if (away.norm() >= kAsideMm && std::abs(axis.dot(away)) >= kAcross * away.norm()) return axis.dot(away);
    }
    return NearestOfBox(bone.box, axis);
  }

  void OrientGroup(const std::vector<size_t>& group) {
    std::optional<double> sum;
    for (const size_t b : group)
      if (sums_[b][0]) sum = sum.value_or(0) + *sums_[b][0];
    const size_t first = group.front();
    const bool backwards = sum ? *sum < 0 : ByShape(first) < 0;
    for (const size_t b : group)
      if (backwards) TurnRound(b);
  }

  const BoneSet& bones_;
  const std::vector<JointPlan>& plans_;
  std::vector<FittedAxes>& joints_;
  std::vector<std::vector<ParallelJoint>> neighbours_;
  std::vector<std::vector<std::optional<double>>> sums_;  // of the angles that the scans show
};

}  // namespace

void OrientAxes(const BoneSet& bones, const std::vector<JointPlan>& plans,
                const std::vector<std::vector<RelativeMotion>>& motions, std::vector<FittedAxes>& joints) {
  Orienting orienting(bones, plans, motions, joints);
  orienting.OrientFirst();
  orienting.OrientOthers();
}

}  // namespace kvx
