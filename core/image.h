// Values on a grid, i fastest. The name of a variable says what they are and, for fields, which way they map.
#pragma once
#include <cstdint>
#include <vector>

#include "core/grid.h"
#include "core/host/parallel.h"

namespace kvx {

template <class T>
struct Image {
  Grid grid;
  std::vector<T> values;

  Image() = default;
  explicit Image(const Grid& g) : Image(g, Zero()) {}
  explicit Image(const Grid& g, T value) : grid(g), values(Filled(g.VoxelCount(), value)) {}
  T& operator()(int i, int j, int k) { return values[grid.Index(i, j, k)]; }
  const T& operator()(int i, int j, int k) const { return values[grid.Index(i, j, k)]; }

 private:
  static T Zero() {
    if constexpr (requires { T::Zero(); })
      return T::Zero();  // of Eigen's, whose T{} is whatever memory held
    else
      return T{};
  }
};

using Volume = Image<float>;       // intensities as stored (MR units, HU)
using LabelMap = Image<uint16_t>;  // 0 = no bone
using Mask = Image<uint8_t>;       // 0 or 1

// Displacements in mm, LPS: a field b_from_a lives on a grid in frame a and maps x to x + u(x) in frame b.
using DisplacementField = Image<Eigen::Vector3f>;

// Trilinear samples at a voxel position; `outside` where the position leaves the hull of voxel centres.
float SampleTrilinear(const Volume& volume, const PointVox& p, float outside = 0.0f);
// Clamped to the border: a field goes on constant outside its grid.
Eigen::Vector3d SampleTrilinear(const DisplacementField& field, const PointVox& p);

}  // namespace kvx
