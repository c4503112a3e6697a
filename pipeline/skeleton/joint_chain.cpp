// Sweeps over the joints, each fitted with its neighbours' axes as they are: coordinate descent on one sum of
// squares.
#include "pipeline/skeleton/joint_chain.h"

namespace kvx {
namespace {

constexpr double kParallelRad = RadFromDeg(5);  // how far the hinges of one finger usually are from parallel
constexpr int kSweeps = 4;

// Joints whose first axes are near parallel to that of each joint, both ways.
std::vector<std::vector<int>> Neighbours(const BoneSet& bones, const std::vector<JointPlan>& plans) {
  std::vector<std::vector<int>> neighbours(plans.size());
  for (int b = 0; b < bones.size(); ++b) {
    const int parent = bones.bones[b].parent;
    if (!plans[b].parallel_to_parent || plans[b].dofs.empty() || plans[parent].dofs.empty()) continue;
    neighbours[b].push_back(parent);
    neighbours[parent].push_back(b);
  }
  return neighbours;
}

}  // namespace

std::vector<Eigen::Matrix3d> FitAllAxes(const BoneSet& bones, const std::vector<JointPlan>& plans,
                                        const std::vector<std::vector<RelativeMotion>>& motions) {
  const std::vector<std::vector<int>> neighbours = Neighbours(bones, plans);
  std::vector<Eigen::Matrix3d> axes(plans.size(), Eigen::Matrix3d::Identity());
  for (int sweep = 0; sweep <= kSweeps; ++sweep) {
    for (int b = 0; b < bones.size(); ++b) {
      if (plans[b].dofs.empty() || (sweep > 0 && neighbours[b].empty())) continue;
      std::vector<AxisBelief> beliefs;  // none at first: every joint by itself
      for (const int n : neighbours[b]) {
        if (sweep > 0) beliefs.push_back({axes[n].col(0), kParallelRad});
      }
      axes[b] = FitAxes(motions[b], bones.bones[b].box, int(plans[b].dofs.size()), beliefs);
    }
  }
  return axes;
}

}  // namespace kvx
