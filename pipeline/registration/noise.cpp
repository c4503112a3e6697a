// Median absolute mixed difference: linear and bilinear intensity changes cancel, noise does not.
#include "pipeline/registration/noise.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace kvx {
namespace {

double Mean(const Volume& volume) {
  return std::accumulate(volume.values.begin(), volume.values.end(), 0.0) / double(volume.values.size());
}

// Of the intensities' spread: a scan without noise still has rounding and sampling errors
constexpr double kLeastShare = 0.005;

double Spread(const Volume& volume) {
  const double mean = Mean(volume);
  double sum = 0;
  for (const float value : volume.values) sum += (value - mean) * (value - mean);
  return std::sqrt(sum / double(volume.values.size()));
}

// sum of (-1)^(di+dj+dk) I / sqrt(8): unit gain for white noise.
double MixedDifference(const Volume& volume, int i, int j, int k) {
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const int odd = (c & 1) ^ ((c >> 1) & 1) ^ (c >> 2);
    sum += (odd ? -1.0 : 1.0) * volume(i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2));
  }
  return sum / std::sqrt(8.0);
}

}  // namespace

double NoiseSigma(const Volume& volume, const Mask& use) {
  constexpr double kMadToSigma = 1.4826;  // normal distribution
  const double floor = kLeastShare * Spread(volume);
  const double threshold = use.values.empty() ? Mean(volume) : 0;
  std::vector<float> differences;
  const Eigen::Vector3i size = volume.grid.size;
  for (int k = 0; k + 1 < size.z(); ++k) {
    for (int j = 0; j + 1 < size.y(); ++j) {
      for (int i = 0; i + 1 < size.x(); ++i) {
        const size_t v = volume.grid.Index(i, j, k);
        if (use.values.empty() ? volume.values[v] <= threshold : !use.values[v]) continue;
        differences.push_back(float(std::abs(MixedDifference(volume, i, j, k))));
      }
    }
  }
  if (differences.empty()) return floor;
  const auto middle = differences.begin() + differences.size() / 2;
  std::nth_element(differences.begin(), middle, differences.end());
  return std::max(floor, kMadToSigma * *middle);
}

}  // namespace kvx
