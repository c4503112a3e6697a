// Seeded randomness that is the same on every machine: hashes, uniform and normal draws, smooth noise in
// space.
#pragma once
#include <cmath>
#include <cstdint>
#include <string_view>

#include "core/frames.h"

namespace kvx::phantom {

inline uint64_t Mix(uint64_t x) {  // splitmix64: every bit of x reaches every bit of the result
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

inline uint64_t Stream(uint64_t seed,
                       std::string_view purpose) {  // seeds of different purposes are unrelated
  uint64_t h = Mix(seed);
  for (const char c : purpose) h = Mix(h ^ uint64_t(uint8_t(c)));
  return h;
}

inline double ToUnit(uint64_t bits) { return double(bits >> 11) * 0x1.0p-53; }  // [0, 1)

// Two independent standard normal values from one hash (Box-Muller).
inline Eigen::Vector2d NormalPair(uint64_t key) {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - ToUnit(Mix(key))));
  const double angle = 2.0 * kPi * ToUnit(Mix(key ^ 0xA5A5A5A5A5A5A5A5ull));
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

// A sequence of draws for one purpose.
class Random {
 public:
  Random(uint64_t seed, std::string_view purpose) : state_(Stream(seed, purpose)) {}

  double Uniform(double low, double high) { return low + (high - low) * ToUnit(Next()); }
  double Normal(double sigma) { return sigma * NormalPair(Next()).x(); }
  Eigen::Vector3d NormalVector(double sigma) {
    const double x = Normal(sigma), y = Normal(sigma), z = Normal(sigma);
    return {x, y, z};
  }

 private:
  uint64_t Next() { return state_ = Mix(state_); }
  uint64_t state_;
};

// Smooth noise in [-1, 1] with features of about one unit (values on the integer lattice, C2 between them).
double SmoothNoise(const Eigen::Vector3d& p, uint64_t seed);
// Octaves of halved feature size and amplitude, scaled to about [-1, 1].
double LayeredNoise(const Eigen::Vector3d& p, uint64_t seed, int octaves);

}  // namespace kvx::phantom
