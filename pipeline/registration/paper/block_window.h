// One block of the published method: its voxels, how well they match, and how they would after a deformation.
#pragma once
#include <span>

#include "pipeline/registration/paper/paper_level.h"

namespace kvx {

using BlockIndex = Eigen::Vector3i;  // in blocks of 8 voxels of the level

// The voxels that count, in the order of the grid.
enum class BlockPart { kBlock, kWithNeighbours };  // B, and B* of 3 x 3 x 3 blocks
std::vector<size_t> CountingVoxels(const PaperLevel& level, const BlockIndex& block, BlockPart part);

// The mismatch of eq. 3's similarity, at least 0, largest where blocks match worst: 1 - MI / min(H, H), or
// the root mean square difference on 0..255.
double Mismatch(bool by_information, std::span<const float> target, std::span<const float> source);

// What is minimised for one block: displacements of its free control points, in voxels of the level, x of all
// of them, y, z.
class BlockWindow {
 public:
  // `deformed`: V^s as it is now.
  BlockWindow(const PaperLevel& level, const Volume& deformed, const BlockIndex& block);

  int parameters() const { return 3 * free_points_; }        // 0: all of it lies in bone
  double Cost(std::span<const double> displacements) const;  // thread-safe
  // Puts the deformation before `shifts`: D'(p) = u(p) + D(p + u(p)). Returns the voxels that changed.
  std::vector<size_t> Compose(std::span<const double> displacements, VoxelShifts& shifts) const;

 private:
  struct Moving {  // a voxel in the ball
    size_t voxel = 0;
    int sample = -1;  // of those that count; -1: does not
    Eigen::Vector3f at;
  };
  Eigen::Vector3f Shift(size_t moving, std::span<const double> displacements) const;

  const PaperLevel& level_;
  const Volume& deformed_;
  int free_points_ = 0;
  std::vector<float> target_, source_;  // of the samples, before the deformation
  std::vector<Moving> moving_;
  std::vector<float> basis_;  // free_points_ per moving voxel
};

}  // namespace kvx
