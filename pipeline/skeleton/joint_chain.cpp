// Sweeps over the joints, each fitted with its neighbours' axes as they are: coordinate descent on one sum of
// squares. After each sweep the study itself says how parallel its hinges are (expectation maximisation).
#include "pipeline/skeleton/joint_chain.h"

#include <cmath>

#include "pipeline/skeleton/joint_axes.h"

namespace kvx {
namespace {

constexpr double kParallelRad = RadFromDeg(5);  // how far the hinges of one finger usually are from parallel
constexpr double kUsual =
    4;  // observations that this counts as beside those of the study: two pairs of joints
constexpr int kSweeps = 8;

// All joints at once, with what is known of how parallel they are.
class Chain {
 public:
  Chain(const BoneSet& bones, const std::vector<JointPlan>& plans,
        const std::vector<std::vector<RelativeMotion>>& motions)
      : bones_(bones),
        plans_(plans),
        motions_(motions),
        neighbours_(ParallelNeighbours(bones, plans)),
        axes_(plans.size(), Eigen::Matrix3d::Identity()) {
    for (int b = 0; b < bones.size(); ++b) Fit(b, {{}, plans[size_t(b)].conjunct_rotation});  // by itself
  }

  void Sweep() {
    for (int b = 0; b < bones_.size(); ++b) {
      if (!neighbours_[b].empty()) Fit(b, KnownOf(b));
    }
  }

  // Expected squares of the angles between neighbours, by how far apart they lie and how well each is known.
  void MeasureParallel() {
    double squares = kUsual * kParallelRad * kParallelRad, count = kUsual;
    std::vector<double> variance(plans_.size(), 0);
    for (int b = 0; b < bones_.size(); ++b)
      if (!neighbours_[b].empty()) variance[b] = VariancesOf(b)[0];
    for (int b = 0; b < bones_.size(); ++b) {
      for (const int n : neighbours_[b]) {
        if (n > b || !std::isfinite(variance[b] + variance[n])) continue;
        squares += axes_[b].col(0).cross(axes_[n].col(0)).squaredNorm() + 2 * (variance[b] + variance[n]);
        count += 2;
      }
    }
    parallel_rad_ = std::sqrt(squares / count);
  }

  std::vector<FittedAxes> Fitted() const {
    std::vector<FittedAxes> out;
    for (int b = 0; b < bones_.size(); ++b)
      out.push_back(Dofs(b) > 0 ? FittedAxes{axes_[b], VariancesOf(b)} : FittedAxes{axes_[b]});
    return out;
  }

 private:
  int Dofs(int b) const { return int(plans_[b].dofs.size()); }
  void Fit(int b, const JointKnowledge& known) {
    if (Dofs(b) > 0) axes_[b] = FitAxes(motions_[b], bones_.bones[b].box, Dofs(b), known);
  }
  Eigen::Vector3d VariancesOf(int b) const {
    return AxisVariances(motions_[b], bones_.bones[b].box, Dofs(b), KnownOf(b), axes_[b]);
  }
  JointKnowledge KnownOf(int b) const {
    JointKnowledge known{{}, plans_[b].conjunct_rotation};
    for (const int n : neighbours_[b]) known.near.push_back({axes_[n].col(0), parallel_rad_});
    return known;
  }

  const BoneSet& bones_;
  const std::vector<JointPlan>& plans_;
  const std::vector<std::vector<RelativeMotion>>& motions_;
  std::vector<std::vector<int>> neighbours_;
  std::vector<Eigen::Matrix3d> axes_;
  double parallel_rad_ = kParallelRad;
};

}  // namespace

std::vector<std::vector<int>> ParallelNeighbours(const BoneSet& bones, const std::vector<JointPlan>& plans) {
  std::vector<std::vector<int>> neighbours(plans.size());
  for (int b = 0; b < bones.size(); ++b) {
    const int parent = bones.bones[b].parent;
    if (!plans[b].parallel_to_parent || plans[b].dofs.empty() || plans[parent].dofs.empty()) continue;
    neighbours[b].push_back(parent);
    neighbours[parent].push_back(b);
  }
  return neighbours;
}

std::vector<FittedAxes> FitAllAxes(const BoneSet& bones, const std::vector<JointPlan>& plans,
                                   const std::vector<std::vector<RelativeMotion>>& motions) {
  Chain chain(bones, plans, motions);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    chain.Sweep();
    chain.MeasureParallel();
  }
  return chain.Fitted();
}

}  // namespace kvx
