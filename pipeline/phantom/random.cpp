// Lattice noise: a hash at each integer point, quintic interpolation between.
#include "pipeline/phantom/random.h"

namespace kvx::phantom {
namespace {

double LatticeValue(int64_t i, int64_t j, int64_t k, uint64_t seed) {
  const uint64_t key = seed + uint64_t(i) * 0x9E3779B97F4A7C15ull + uint64_t(j) * 0xC2B2AE3D27D4EB4Full +
                       uint64_t(k) * 0x165667B19E3779F9ull;
  return 2.0 * ToUnit(Mix(key)) - 1.0;
}

double Quintic(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

}  // namespace

double SmoothNoise(const Eigen::Vector3d& p, uint64_t seed) {
  const Eigen::Vector3d base = p.array().floor();
  const Eigen::Vector3d f = p - base;
  const int64_t i = int64_t(base.x()), j = int64_t(base.y()), k = int64_t(base.z());
  const double u = Quintic(f.x()), v = Quintic(f.y()), w = Quintic(f.z());
  double planes[2];
  for (int c = 0; c < 2; ++c) {
    const double y0 = (1 - u) * LatticeValue(i, j, k + c, seed) + u * LatticeValue(i + 1, j, k + c, seed);
    const double y1 =
        (1 - u) * LatticeValue(i, j + 1, k + c, seed) + u * LatticeValue(i + 1, j + 1, k + c, seed);
    planes[c] = (1 - v) * y0 + v * y1;
  }
  return (1 - w) * planes[0] + w * planes[1];
}

double LayeredNoise(const Eigen::Vector3d& p, uint64_t seed, int octaves) {
  double sum = 0, weight = 1, total = 0, frequency = 1;
  for (int octave = 0; octave < octaves; ++octave) {
    sum += weight * SmoothNoise(p * frequency, seed + uint64_t(octave) * 7919);
    total += weight;
    weight *= 0.6;
    frequency *= 2.0;
  }
  return sum / total * 1.5;
}

}  // namespace kvx::phantom
