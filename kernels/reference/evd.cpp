// The forward map in double.
#include "kernels/reference/evd.h"

namespace kvx::reference {

Places EvdForward(const BrickedBody& body, const Grid& from, const Grid& to, const PoseVector& pose,
                  const Eigen::MatrixXf& coefficients) {
  Places posed(size_t(body.stored()) * BrickedBody::kNodes);
  for (size_t node = 0; node < posed.size(); ++node) {
    const int brick = int(node / BrickedBody::kNodes), slot = int(node % BrickedBody::kNodes);
    const VoxelWeights w = body.NodeWeights(brick, slot);
    Eigen::Vector3d v = (body.FirstNode(brick) + BrickedBody::Offset(slot)).cast<double>();
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
