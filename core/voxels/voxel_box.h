// A box of voxels of a grid, and the part of an image in it.
#pragma once
#include <algorithm>
#include <map>

#include "core/host/own_or_lent.h"
#include "core/host/parallel.h"
#include "core/image.h"

namespace kvx {

struct VoxelBox {
  Eigen::Vector3i low = Eigen::Vector3i::Zero(), high = Eigen::Vector3i::Zero();  // high is outside

  bool empty() const { return (high.array() <= low.array()).any(); }
  Eigen::Vector3i size() const { return high - low; }
  void Include(const Eigen::Vector3i& voxel);
  bool Contains(const Eigen::Vector3i& voxel) const {
    return (voxel.array() >= low.array()).all() && (voxel.array() < high.array()).all();
  }
  VoxelBox Grown(const Eigen::Vector3i& by, const Grid& within) const;
};

// Of the voxels that are set; empty without any.
VoxelBox BoxOf(const Mask& mask);
// Of the voxels of a label.
VoxelBox BoxOf(const LabelMap& labels, int label);
// Of every label that has voxels, but 0.
std::map<int, VoxelBox> BoxesOf(const LabelMap& labels);

// The grid of the box's voxels: the same places in the world.
Grid GridOf(const VoxelBox& box, const Grid& grid);

// Grown to every side by at least this much, as far as the grid goes.
VoxelBox GrownByMm(const VoxelBox& box, double margin_mm, const Grid& within);

// From corner to corner.
double DiagonalMm(const VoxelBox& box, const Grid& grid);

// Calls visit(voxel), i fastest.
template <class Visit>
void ForEachVoxel(const VoxelBox& box, Visit&& visit) {
  for (int k = box.low.z(); k < box.high.z(); ++k) {
    for (int j = box.low.y(); j < box.high.y(); ++j) {
      for (int i = box.low.x(); i < box.high.x(); ++i) visit(Eigen::Vector3i(i, j, k));
    }
  }
}

// Calls visit(voxel of the box's grid, index there, index in the whole grid), i fastest.
template <class Visit>
void ForEachVoxel(const VoxelBox& box, const Grid& grid, Visit&& visit) {
  size_t part = 0;
  for (int k = box.low.z(); k < box.high.z(); ++k) {
    for (int j = box.low.y(); j < box.high.y(); ++j) {
      size_t whole = grid.Index(box.low.x(), j, k);
      for (int i = box.low.x(); i < box.high.x(); ++i) {
        visit(Eigen::Vector3i(Eigen::Vector3i(i, j, k) - box.low), part++, whole++);
      }
    }
  }
}

template <class T>
Image<T> Cropped(const Image<T>& image, const VoxelBox& box) {
  Image<T> out(GridOf(box, image.grid));
  if (box.empty()) return out;
  const size_t length = size_t(box.size().x()), rows = size_t(box.size().y());  // of a slice
  ParallelEach(rows * size_t(box.size().z()), [&](size_t row) {
    const int j = box.low.y() + int(row % rows), k = box.low.z() + int(row / rows);
    std::copy_n(&image(box.low.x(), j, k), length, out.values.data() + row * length);
  });
  return out;
}

// As Cropped; the image itself where the box is all of it.
template <class T>
OwnOrLent<Image<T>> Within(const Image<T>& image, const VoxelBox& box) {
  if (box.low == Eigen::Vector3i::Zero() && box.high == image.grid.size) return image;
  return Cropped(image, box);
}

}  // namespace kvx
