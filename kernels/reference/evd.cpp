// The forward map in double.
#include "kernels/reference/evd.h"

namespace kvx::reference {

std::vector<Eigen::Vector3d> EvdAdded(const BrickedBody& body, const AddedDisplacement& added,
                                      const LabelMap& bone_labels) {
  std::vector<Eigen::Vector3d> out;
  for (int brick = 0; brick < body.stored(); ++brick) {
    for (int slot = 0; slot < BrickedBody::kNodes; ++slot) {
      const Eigen::Vector3i node = body.FirstNode(brick) + BrickedBody::Offset(slot);
      const Eigen::Vector3i p = node.cwiseMin(bone_labels.grid.size - Eigen::Vector3i::Ones());
      out.push_back(bone_labels(p.x(), p.y(), p.z()) ? Eigen::Vector3d::Zero() : added.At(node));
    }
  }
  return out;
}

Places EvdForward(const BrickedBody& body, const Grid& from, const Grid& to, const PoseVector& pose,
                  const Eigen::MatrixXf& coefficients, std::span<const Eigen::Vector3d> added) {
  Places posed(size_t(body.stored()) * BrickedBody::kNodes);
  for (size_t node = 0; node < posed.size(); ++node) {
    const int brick = int(node / BrickedBody::kNodes), slot = int(node % BrickedBody::kNodes);
    const VoxelWeights w = body.NodeWeights(brick, slot);
    Eigen::Vector3d v = (body.FirstNode(brick) + BrickedBody::Offset(slot)).cast<double>();
    if (!added.empty()) v += added[node];
    for (uint32_t e = body.example_first[brick]; e < body.example_first[brick + 1]; ++e) {
      const int k = body.example_refs[e].k;
      if (k >= coefficients.cols()) continue;
      double c = 0;
      for (int s = 0; s < kBonesPerVoxel; ++s) c += double(w.weights[s]) * coefficients(w.bones[s], k);
      v += c * body.NodeExample(e, slot);
    }
    posed[node] = to.ToVox({Apply(Blend(w, pose), from.ToMm(PointVox{v}).lps)}).ijk;
  }
  return posed;
}

}  // namespace kvx::reference
