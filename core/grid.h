// A regular grid of voxels in the world: size, spacing (mm),
// origin (LPS mm of voxel 0,0,0), direction (columns = axes).
#pragma once
#include <cstddef>

#include "core/frames.h"

namespace kvx {

struct Grid {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();  // voxels along i, j, k; i varies fastest in memory
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();
  PointMm origin;
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();  // orthonormal; may be left-handed

  size_t VoxelCount() const { return size_t(size.x()) * size.y() * size.z(); }
  size_t Index(int i, int j, int k) const { return (size_t(k) * size.y() + j) * size.x() + i; }
  Eigen::Vector3i Ijk(size_t index) const {
    const size_t row = index / size.x();
    return {int(index % size.x()), int(row % size.y()), int(row / size.y())};
  }
  bool Contains(const Eigen::Vector3i& ijk) const {
    return (ijk.array() >= 0).all() && (ijk.array() < size.array()).all();
  }
  // Inside the hull of voxel centres, where trilinear interpolation needs no voxel outside.
  bool Contains(const PointVox& p) const {
    return (p.ijk.array() >= 0).all() && (p.ijk.array() <= (size.array() - 1).cast<double>()).all();
  }

  // Of places outside, the nearest that the grid contains.
  Eigen::Vector3i Nearest(const Eigen::Vector3i& ijk) const {
    return ijk.cwiseMax(0).cwiseMin((size.array() - 1).matrix());
  }
  PointVox Nearest(const PointVox& p) const {
    return {p.ijk.cwiseMax(0.0).cwiseMin((size.array() - 1).cast<double>().matrix())};
  }

  PointMm ToMm(const PointVox& p) const { return {origin.lps + MmFromVox() * p.ijk}; }
  PointMm ToMm(int i, int j, int k) const { return ToMm(PointVox{Eigen::Vector3d(i, j, k)}); }
  PointMm Middle() const { return ToMm(PointVox{0.5 * (size.array() - 1).cast<double>().matrix()}); }
  PointVox ToVox(const PointMm& x) const { return {VoxFromMm() * (x.lps - origin.lps)}; }
  Eigen::Matrix3d MmFromVox() const { return direction * spacing_mm.asDiagonal(); }  // for vectors
  Eigen::Matrix3d VoxFromMm() const { return spacing_mm.cwiseInverse().asDiagonal() * direction.transpose(); }
  double MeanSpacingMm() const { return std::cbrt(spacing_mm.prod()); }

  bool operator==(const Grid& other) const;  // the same voxels: equal to 1e-6 mm
};

// Throws InputError unless sizes are positive, spacing finite and positive, and the direction orthonormal.
void Validate(const Grid& grid);
// The same field of view with every axis `factor` times coarser
// (voxel blocks share centres with their union).
Grid Coarsened(const Grid& grid, int factor);

}  // namespace kvx
