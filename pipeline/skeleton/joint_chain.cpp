// Sweeps over the joints, each fitted with its neighbours' axes as they are: coordinate descent on one sum of
// squares. After each sweep the study itself says how parallel its hinges are (expectation maximisation).
#include "pipeline/skeleton/joint_chain.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Cholesky>

#include "core/joint_values.h"
#include "pipeline/skeleton/joint_axes.h"

namespace kvx {
namespace {

constexpr double kUsual =
    4;  // observations that the usual spread of hinges counts as beside those of the study: two pairs
constexpr int kMostSweeps = 200;
constexpr double kSettledRad = RadFromDeg(0.02);  // a sweep that moves no axis farther is the last one
constexpr double kFreeRad = 10;                   // spread of a direction that nothing speaks of: any

// Where a joint stands in a row, its first axis lies about along the line from the base before to the one
// after, across the bone; none where the row runs along the bone.
std::vector<std::optional<AxisBelief>> AlongRows(const BoneSet& bones, const std::vector<JointPlan>& plans) {
  constexpr double kAcross = 0.5;  // of the line
  std::vector<Eigen::Vector3d> lines(plans.size(), Eigen::Vector3d::Zero());
  std::vector<double> spreads_rad(plans.size(), 0.0);
  for (size_t b = 0; b < plans.size(); ++b) {
    for (const ParallelJoint& joint : plans[b].parallel) {
      const auto n = size_t(joint.bone);
      if (joint.along_rad == 0) continue;
      for (const size_t j : {b, n}) {
        lines[j] += bones.bones[b].box.origin.lps - bones.bones[n].box.origin.lps;
        spreads_rad[j] = joint.along_rad;
      }
    }
  }
  std::vector<std::optional<AxisBelief>> beliefs(plans.size());
  for (size_t b = 0; b < plans.size(); ++b) {
    const Eigen::Vector3d along = bones.bones[b].box.axes.col(0),
                          across = lines[b] - along * along.dot(lines[b]);
    if (across.norm() > kAcross * lines[b].norm()) beliefs[b] = {across.normalized(), spreads_rad[b]};
  }
  return beliefs;
}

// All joints at once, with what is known of how parallel they are.
class Chain {
 public:
  Chain(const BoneSet& bones, const std::vector<JointPlan>& plans,
        const std::vector<std::vector<RelativeMotion>>& motions)
      : bones_(bones),
        plans_(plans),
        motions_(motions),
        neighbours_(TellingNeighbours(bones, plans)),
        along_(AlongRows(bones, plans)),
        axes_(plans.size(), Eigen::Matrix3d::Identity()) {
    for (int b = 0; b < bones.size(); ++b) {
      if (Dofs(b) > 0) axes_[b] = FitAxes(motions_[b], bones_.bones[b].box, Dofs(b), KnownOf(b, {}));
    }
    TakeFromThoseThatShow();
  }

  // How far it has moved an axis at most.
  double Sweep() {
    double most_rad = 0;
    for (int b = 0; b < bones_.size(); ++b) {
      if (neighbours_[b].empty()) continue;
      const Eigen::Matrix3d before = axes_[b];
      Fit(b, neighbours_[b]);
      most_rad = std::max(most_rad, RotationVector(Eigen::Quaterniond(before.transpose() * axes_[b])).norm());
    }
    return most_rad;
  }

  // Expected squares of the angles between neighbours in parts of what is usual, by how far apart they lie
  // and how well that is known.
  void MeasureParallel() {
    double squares = kUsual, count = kUsual;
    const Eigen::MatrixXd covariance = Covariance();
    for (int b = 0; b < bones_.size(); ++b) {
      for (const ParallelJoint& joint : neighbours_[b]) {
        const int n = joint.bone;
        if (n > b || !joint.learnt) continue;
        const Eigen::Matrix<double, 3, 6> of_turns = BetweenByTurns(b, n);
        const double square = Between(b, n).squaredNorm() +
                              (of_turns * PairOf(covariance, b, n) * of_turns.transpose()).trace();
        squares += square / (joint.spread_rad * joint.spread_rad);
        count += 2;
      }
    }
    learnt_ = std::sqrt(squares / count);
  }

  std::vector<FittedAxes> Fitted() const {
    const Eigen::MatrixXd covariance = Covariance();
    std::vector<FittedAxes> out;
    for (int b = 0; b < bones_.size(); ++b) {
      FittedAxes fitted{axes_[b]};
      if (Dofs(b) > 0 && (told_[size_t(b)] || neighbours_[b].empty())) {
        const Eigen::Matrix3d of_turns = covariance.block<3, 3>(3 * b, 3 * b);
        fitted.variances = AxisVariances(CertaintyOf(b), of_turns, axes_[b]);
        if (std::isfinite(fitted.variances[0])) fitted.covariance = of_turns;
      }
      out.push_back(fitted);
    }
    return out;
  }

 private:
  int Dofs(int b) const { return int(plans_[b].dofs.size()); }
  double SpreadOf(const ParallelJoint& joint) const {
    return joint.spread_rad * (joint.learnt ? learnt_ : 1);
  }
  void Fit(int b, const std::vector<ParallelJoint>& near) {
    if (Dofs(b) > 0)
      axes_[b] = FitAxes(motions_[b], bones_.bones[b].box, Dofs(b), KnownOf(b, near), axes_[b]);
  }
  JointKnowledge KnownOf(int b, const std::vector<ParallelJoint>& near) const {
    JointKnowledge known{{}, plans_[b].conjunct_rotation};
    if (along_[size_t(b)]) known.near.push_back(*along_[size_t(b)]);
    for (const ParallelJoint& n : near) known.near.push_back({axes_[n.bone].col(0), SpreadOf(n)});
    return known;
  }
  AxisCertainty CertaintyOf(int b) const {
    return kvx::CertaintyOf(motions_[b], bones_.bones[b].box, Dofs(b), KnownOf(b, neighbours_[b]), axes_[b]);
  }

  // A hinge that scans show and a place in a row say which of two axes is the first. Without these beside it,
  // also by way of others, the dominant axis of a joint of two may as well be its second.
  bool TellsFirst(int b) const {
    return along_[size_t(b)] || (Dofs(b) == 1 && ShowsAnAxis(motions_[size_t(b)]));
  }

  // An axis that no scan shows starts from those beside it that scans do show, on and on: the bone's box
  // would draw these away first, and how far they come back hangs on how many sweeps follow.
  void TakeFromThoseThatShow() {
    for (int b = 0; b < bones_.size(); ++b) told_.push_back(TellsFirst(b));
    TakeFrom(told_);
    std::vector<bool> shown = told_;
    for (size_t b = 0; b < shown.size(); ++b) shown[b] = shown[b] || ShowsAnAxis(motions_[b]);
    TakeFrom(shown);
  }
  void TakeFrom(std::vector<bool>& shown) {
    bool more = true;
    while (more) {
      more = false;
      for (int b = 0; b < bones_.size(); ++b) {
        std::vector<ParallelJoint> that_show = neighbours_[b];
        std::erase_if(that_show, [&](const ParallelJoint& n) { return !shown[size_t(n.bone)]; });
        if (shown[size_t(b)] || that_show.empty()) continue;
        Fit(b, that_show);
        shown[size_t(b)] = more = true;
      }
    }
  }

  // Sine of the angle between two joints' first axes, as a vector, and how small turns of the one and of the
  // other change it.
  Eigen::Vector3d Between(int b, int n) const { return axes_[b].col(0).cross(axes_[n].col(0)); }
  Eigen::Matrix<double, 3, 6> BetweenByTurns(int b, int n) const {
    Eigen::Matrix<double, 3, 6> out;
    out << ByTurns(axes_[b].col(0), axes_[n].col(0)), -ByTurns(axes_[n].col(0), axes_[b].col(0));
    return out;
  }
  // Of the cross product of an axis and one that stays.
  static Eigen::Matrix3d ByTurns(const Eigen::Vector3d& axis, const Eigen::Vector3d& other) {
    Eigen::Matrix3d out;
    for (int c = 0; c < 3; ++c) out.col(c) = Eigen::Vector3d::Unit(c).cross(axis).cross(other);
    return out;
  }
  Eigen::Matrix<double, 6, 6> PairOf(const Eigen::MatrixXd& all, int b, int n) const {
    Eigen::Matrix<double, 6, 6> out;
    out << all.block<3, 3>(3 * b, 3 * b), all.block<3, 3>(3 * b, 3 * n), all.block<3, 3>(3 * n, 3 * b),
        all.block<3, 3>(3 * n, 3 * n);
    return out;
  }

  // Of small turns of all joints' axes: an axis that its neighbours alone tell of is known as they are.
  Eigen::MatrixXd Covariance() const {
    const Eigen::Index count = 3 * bones_.size();
    Eigen::MatrixXd information = Eigen::MatrixXd::Identity(count, count) / (kFreeRad * kFreeRad);
    for (int b = 0; b < bones_.size(); ++b) {
      if (Dofs(b) == 0) continue;
      information.block<3, 3>(3 * b, 3 * b) += CertaintyOf(b).information;
      if (const std::optional<AxisBelief>& row = along_[size_t(b)]; row && Dofs(b) < 3) {
        const Eigen::Matrix3d of_turns = ByTurns(axes_[b].col(0), row->axis) / row->spread_rad;
        information.block<3, 3>(3 * b, 3 * b) += of_turns.transpose() * of_turns;
      }
      for (const ParallelJoint& joint : neighbours_[b]) {
        const int n = joint.bone;
        if (n > b) continue;
        const Eigen::Matrix<double, 3, 6> of_turns = BetweenByTurns(b, n) / SpreadOf(joint);
        const Eigen::Matrix<double, 6, 6> pair = of_turns.transpose() * of_turns;
        information.block<3, 3>(3 * b, 3 * b) += pair.topLeftCorner<3, 3>();
        information.block<3, 3>(3 * b, 3 * n) += pair.topRightCorner<3, 3>();
        information.block<3, 3>(3 * n, 3 * b) += pair.bottomLeftCorner<3, 3>();
        information.block<3, 3>(3 * n, 3 * n) += pair.bottomRightCorner<3, 3>();
      }
    }
    return information.llt().solve(Eigen::MatrixXd::Identity(count, count));
  }

  const BoneSet& bones_;
  const std::vector<JointPlan>& plans_;
  const std::vector<std::vector<RelativeMotion>>& motions_;
  std::vector<std::vector<ParallelJoint>> neighbours_;
  std::vector<std::optional<AxisBelief>> along_;
  std::vector<Eigen::Matrix3d> axes_;
  std::vector<bool> told_;  // which of its axes is the first
  double learnt_ = 1;       // spreads that are learnt, in parts of the usual ones
};

}  // namespace

std::vector<std::vector<ParallelJoint>> ParallelNeighbours(const BoneSet& bones,
                                                           const std::vector<JointPlan>& plans) {
  std::vector<std::vector<ParallelJoint>> neighbours(plans.size());
  for (int b = 0; b < bones.size(); ++b) {
    for (ParallelJoint joint : plans[b].parallel) {
      if (plans[b].dofs.empty() || plans[size_t(joint.bone)].dofs.empty()) continue;
      neighbours[b].push_back(joint);
      neighbours[std::exchange(joint.bone, b)].push_back(joint);
    }
  }
  return neighbours;
}

std::vector<std::vector<ParallelJoint>> TellingNeighbours(const BoneSet& bones,
                                                          const std::vector<JointPlan>& plans) {
  const auto explains_all = [&](int b) { return TurnsAmong(plans[size_t(b)].dofs.size()) == kMostTurns; };
  std::vector<std::vector<ParallelJoint>> neighbours = ParallelNeighbours(bones, plans);
  for (int b = 0; b < bones.size(); ++b)
    std::erase_if(neighbours[size_t(b)],
                  [&](const ParallelJoint& n) { return explains_all(b) || explains_all(n.bone); });
  return neighbours;
}

std::vector<FittedAxes> FitAllAxes(const BoneSet& bones, const std::vector<JointPlan>& plans,
                                   const std::vector<std::vector<RelativeMotion>>& motions) {
  Chain chain(bones, plans, motions);
  double moved_rad = 2 * kSettledRad;
  for (int sweep = 0; sweep < kMostSweeps && moved_rad > kSettledRad; ++sweep) {
    moved_rad = chain.Sweep();
    chain.MeasureParallel();
  }
  return chain.Fitted();
}

}  // namespace kvx
