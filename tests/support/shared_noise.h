// A ramp with noise that neighbours share, as interpolated scans have it.
#pragma once
#include <Eigen/Core>
#include <random>

#include "tests/support/fixtures.h"

namespace kvx::testing_support {

// Of white noise of sigma 3, at every voxel the mean of two neighbours, `times` times over, along the first
// `axes` axes.
inline Volume RampWithSharedNoise(int times, int axes = 3) {
  const Eigen::Vector3i size = Eigen::Vector3i::Constant(32);
  Volume noise(ObliqueGrid(size + Eigen::Vector3i::Constant(times)));
  std::mt19937 random(3);
  std::normal_distribution<float> white(0, 3);
  for (float& value : noise.values) value = white(random);
  for (int pass = 0; pass < times * axes; ++pass) {
    const Eigen::Vector3i next = Eigen::Vector3i::Unit(pass % axes);
    const size_t beside = noise.grid.Index(next.x(), next.y(), next.z());
    for (size_t v = 0; v + beside < noise.values.size(); ++v)
      noise.values[v] = (noise.values[v] + noise.values[v + beside]) / 2;
  }
  Volume out = LinearRamp{}.On(ObliqueGrid(size));
  for (size_t v = 0; v < out.values.size(); ++v) {
    const Eigen::Vector3i p = out.grid.Ijk(v);
    out.values[v] += noise(p.x(), p.y(), p.z());
  }
  return out;
}

}  // namespace kvx::testing_support
