// Grids with voxels between those of a grid: every voxel centre stays one, and no other lies beyond the
// outermost.
#pragma once
#include "core/host/own_or_lent.h"
#include "core/image.h"

namespace kvx {

constexpr int kMostTimesFiner = 4;  // along an axis

// `times`: whole numbers from 1 on; voxel p of `grid` is voxel times * p of the finer one.
Grid FinerGrid(const Grid& grid, const Eigen::Vector3i& times);

// The grid whose FinerGrid this is.
Grid CoarserGrid(const Grid& finer, const Eigen::Vector3i& times);

// What an image on a finer grid shows at the voxels of the one that it was made from.
template <class T>
OwnOrLent<Image<T>> EveryVoxelOf(const Image<T>& finer, const Eigen::Vector3i& times) {
  if ((times.array() == 1).all()) return finer;
  Image<T> out(CoarserGrid(finer.grid, times));
  for (size_t v = 0; v < out.values.size(); ++v) {
    const Eigen::Vector3i p = out.grid.Ijk(v).cwiseProduct(times);
    out.values[v] = finer(p.x(), p.y(), p.z());
  }
  return out;
}

// How many voxels in the place of one, along each axis, are about as wide as `spacing_mm`; 1 where it is no
// wider than half as much again, at most kMostTimesFiner.
Eigen::Vector3i TimesFiner(const Grid& grid, double spacing_mm);

// The same towards a cube of the voxel's own volume: 1 everywhere for voxels that are nearly cubes.
Eigen::Vector3i TimesTowardsCubes(const Grid& grid);

}  // namespace kvx
