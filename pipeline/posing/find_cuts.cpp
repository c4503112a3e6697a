// A jump is most of a voxel's weight changing hands from one voxel to the next: no blend is that steep.
#include "pipeline/posing/find_cuts.h"

#include "core/host/parallel.h"
#include "core/voxels/to_corner.h"

namespace kvx {
namespace {

constexpr float kJump = 1.0f;  // of the weights' absolute differences, 0 to 2

bool AreKin(const BoneSet& bones, int a, int b) {
  if (a == b || a >= bones.size() || b >= bones.size()) return true;
  const int up_a = bones.bones[size_t(a)].parent, up_b = bones.bones[size_t(b)].parent;
  return up_a == b || up_b == a || up_a == up_b;
}

float WeightOf(const VoxelWeights& w, uint8_t bone) {
  float sum = 0;
  for (int s = 0; s < kBonesPerVoxel; ++s) sum += w.bones[s] == bone ? w.weights[s] : 0.0f;
  return sum;
}

bool Jumps(const BoneSet& bones, const VoxelWeights& a, const VoxelWeights& b) {
  if (AreKin(bones, a.bones[0], b.bones[0])) return false;
  float shared = 0;  // |a - b| summed is 2 - 2 * what they share
  for (int s = 0; s < kBonesPerVoxel; ++s)
    if (a.weights[s] > 0) shared += std::min(a.weights[s], WeightOf(b, a.bones[s]));
  return 2 - 2 * shared > kJump;
}

bool IsCut(const BrickedBody& body, int brick, const Eigen::Vector3i& offset, const BoneSet& bones,
           const WeightMap& weights) {
  const VoxelWeights* corners[8];
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i d = ToCorner(corner);
    if (!body.IsBody(brick, offset + d)) return false;  // air has its own rule
    const Eigen::Vector3i node = body.FirstNode(brick) + offset + d;
    corners[corner] = &weights.values[weights.grid.Index(node.x(), node.y(), node.z())];
  }
  for (int a = 0; a < 8; ++a) {
    for (const int axis : {1, 2, 4})
      if (!(a & axis) && Jumps(bones, *corners[a], *corners[a | axis])) return true;
  }
  return false;
}

// All body, and at an outer face of the grid: the body was cut there, half a voxel beyond the last centres.
bool IsCutEnd(const BrickedBody& body, int brick, const Eigen::Vector3i& offset, const Grid& grid) {
  const Eigen::Array3i low = (body.FirstNode(brick) + offset).array();
  if (!(low == 0).any() && !(low == grid.size.array() - 2).any()) return false;
  for (int corner = 0; corner < 8; ++corner)
    if (!body.IsBody(brick, offset + ToCorner(corner))) return false;
  return true;
}

}  // namespace

std::vector<std::array<uint64_t, 2>> FindCuts(const BrickedBody& body, const BoneSet& bones,
                                              const WeightMap& weights) {
  std::vector<std::array<uint64_t, 2>> cuts(size_t(body.cell_bricks), {0, 0});
  ParallelEach(cuts.size(), [&](size_t brick) {
    for (int slot = 0; slot < BrickedBody::kNodes; ++slot) {
      const Eigen::Vector3i offset = BrickedBody::Offset(slot);
      cuts[brick][0] |= uint64_t(IsCut(body, int(brick), offset, bones, weights)) << slot;
      cuts[brick][1] |= uint64_t(IsCutEnd(body, int(brick), offset, weights.grid)) << slot;
    }
  });
  for (size_t brick = 0; brick < cuts.size(); ++brick) {
    for (int slot = 0; slot < BrickedBody::kNodes; ++slot) {
      if (!(cuts[brick][0] >> slot & 1)) continue;
      for (int n = 0; n < 27; ++n) {
        const Eigen::Vector3i beside = body.FirstNode(int(brick)) + BrickedBody::Offset(slot) +
                                       Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
        const int other = body.BrickOf(beside);
        if (other >= 0 && other < body.cell_bricks)
          cuts[size_t(other)][1] |= uint64_t(1) << BrickedBody::Slot(beside);
      }
    }
  }
  return cuts;
}

}  // namespace kvx
