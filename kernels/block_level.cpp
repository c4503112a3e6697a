// The ball of one block, sampled once per level, and the means over a level's cells.
#include "kernels/block_level.h"

#include "core/host/parallel.h"

namespace kvx {
namespace {

constexpr double kCentre = 0.5 * (kSupportVoxels - 1), kRadius = 0.5 * kSupportVoxels;

std::array<float, kControlPoints> BasisAt(const BlockSpline& spline, const Eigen::Vector3d& voxel) {
  const ControlRow row = spline.Basis((voxel - Eigen::Vector3d::Constant(kCentre)) / kRadius);
  std::array<float, kControlPoints> out;
  for (int a = 0; a < kControlPoints; ++a) out[a] = float(row[a]);
  return out;
}

void AddCell(const BlockSpline& spline, const Eigen::Vector3i& cell, BallBasis& ball) {
  const Eigen::Vector3d centre = 2.0 * cell.cast<double>() + Eigen::Vector3d::Constant(0.5);
  if ((centre - Eigen::Vector3d::Constant(kCentre)).norm() >= kRadius) return;
  ball.cells.push_back({{cell.x(), cell.y(), cell.z(), 0}});
  ball.cell_basis.push_back(BasisAt(spline, centre));
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i v = 2 * cell + Eigen::Vector3i(corner & 1, (corner >> 1) & 1, corner >> 2);
    ball.voxels.push_back({{v.x(), v.y(), v.z(), 0}});
  }
}

}  // namespace

BallBasis MakeBallBasis(const BlockSpline& spline) {
  BallBasis ball;
  for (int k = 0; k < kSupportVoxels / 2; ++k) {
    for (int j = 0; j < kSupportVoxels / 2; ++j) {
      for (int i = 0; i < kSupportVoxels / 2; ++i) AddCell(spline, {i, j, k}, ball);
    }
  }
  return ball;
}

std::vector<float> CellMeans(const Grid& grid, std::span<const float> image) {
  const Grid cells = Coarsened(grid, 2);
  std::vector<float> out(cells.VoxelCount());
  ParallelEach(out.size(), [&](size_t c) {
    const Eigen::Vector3i first = 2 * cells.Ijk(c);
    float sum = 0, count = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i p = first + Eigen::Vector3i(corner & 1, (corner >> 1) & 1, corner >> 2);
      if (grid.Contains(p)) sum += image[grid.Index(p.x(), p.y(), p.z())], count += 1;
    }
    out[c] = sum / count;
  });
  return out;
}

}  // namespace kvx
