// Median absolute mixed difference: linear and bilinear intensity changes cancel, noise does not. What
// neighbours share of their noise hides from it, and shows in differences over two voxels.
#include "pipeline/registration/images/noise.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"
#include "core/voxels/to_corner.h"

namespace kvx {
namespace {

double Mean(const Volume& volume) {
  const auto add = [&](double& sum, size_t v) { sum += volume.values[v]; };
  return ParallelSum<double>(volume.values.size(), add) / double(volume.values.size());
}

// Of the intensities' spread: a scan without noise still has rounding and sampling errors
constexpr double kLeastShare = 0.005;

double Spread(const Volume& volume) {
  const double mean = Mean(volume);
  const auto add = [&](double& sum, size_t v) {
    sum += (volume.values[v] - mean) * (volume.values[v] - mean);
  };
  return std::sqrt(ParallelSum<double>(volume.values.size(), add) / double(volume.values.size()));
}

// sum of (-1)^(di+dj+dk) I / sqrt(8) over the corners of a box of `step` voxels: unit gain for white noise.
double MixedDifference(const Volume& volume, const Eigen::Vector3i& at, const Eigen::Vector3i& step) {
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const Eigen::Vector3i p = at + ToCorner(c).cwiseProduct(step);
    const int odd = (c & 1) ^ (c >> 1 & 1) ^ (c >> 2);
    sum += (odd ? -1.0 : 1.0) * volume(p.x(), p.y(), p.z());
  }
  return sum / std::sqrt(8.0);
}

// Their absolute values, from every nth row of every nth slice; `use(v)`: whether the box whose first corner
// is voxel v is looked at.
template <class Use>
std::vector<float> MixedDifferences(const Volume& volume, const Eigen::Vector3i& step, int nth,
                                    const Use& use) {
  const Eigen::Vector3i end = volume.grid.size - step;
  const size_t slices = size_t(std::max(0, (end.z() + nth - 1) / nth));
  return ParallelCollect<float>(slices, [&](std::vector<float>& differences, size_t n) {
    const int k = int(n) * nth;
    for (int j = 0; j < end.y(); j += nth) {
      for (int i = 0; i < end.x(); ++i) {
        if (use(volume.grid.Index(i, j, k)))
          differences.push_back(float(std::abs(MixedDifference(volume, {i, j, k}, step))));
      }
    }
  });
}

// Mean square of the smaller half: finer than a median where values come in few steps.
double SquareOfSmaller(std::vector<float>& values) {
  TakeMedian(values);
  const size_t half = values.size() / 2;
  const double sum = std::accumulate(values.begin(), values.begin() + half, 0.0,
                                     [](double so_far, float v) { return so_far + double(v) * v; });
  return sum / double(std::max<size_t>(1, half));
}

// How many times the variance of differences between neighbours the noise has, by how many times that of
// differences over two voxels along an axis is: as many, where noise reaches no farther than the next voxel.
double VarianceHidden(double ratio) {
  constexpr double kByAnatomy = 1.5;  // up to here anatomy alone does it
  constexpr double kByNoise = 2;      // from here on it is noise
  constexpr double kMost = 3;         // 4 where there is no noise, but smooth anatomy
  if (ratio >= kByNoise) return std::min(ratio, kMost);
  return 1 + (kByNoise - 1) * std::max(0.0, ratio - kByAnatomy) / (kByNoise - kByAnatomy);
}

constexpr double kMostRatio = 3.5;  // no matter how many voxels share their noise

// How many voxels along an axis share their noise, by the same ratio: white noise interpolated to 1.5 and 2
// times as many has 2.1 to 2.3 and 2.8 to 3.2.
double SharedAlong(double ratio) {
  constexpr double kByAnatomy = 1.5, kPerRatio = 0.8;
  return 1 + kPerRatio * std::max(0.0, std::min(ratio, kMostRatio) - kByAnatomy);
}

struct NoiseSeen {
  double floor = 0, sigma = 0;  // the least that is taken for noise; what there is
  double shared = 1;            // voxels in a row that share noise, along the axis where fewest do
};

NoiseSeen SeenIn(const Volume& volume, const Mask& use) {
  constexpr size_t kManyVoxels = 1000000;  // a ninth of which says enough
  NoiseSeen out{.floor = kLeastShare * Spread(volume)};
  const double threshold = use.values.empty() ? Mean(volume) : 0;
  const auto looked_at = [&](size_t v) {
    return use.values.empty() ? volume.values[v] > threshold : use.values[v] != 0;
  };
  const Eigen::Vector3i next = Eigen::Vector3i::Ones();
  const int nth = volume.values.size() > kManyVoxels ? 3 : 1;
  std::vector<float> differences = MixedDifferences(volume, next, nth, looked_at);
  if (differences.empty()) return out;
  out.sigma = kSdOfMad * TakeMedian(differences);
  const double square = SquareOfSmaller(differences);
  double least_ratio = kMostRatio;
  for (int a = 0; a < 3 && square > 0; ++a) {
    std::vector<float> farther = MixedDifferences(volume, next + Eigen::Vector3i::Unit(a), nth, looked_at);
    const double ratio = farther.empty() ? 1 : SquareOfSmaller(farther) / square;
    out.sigma *= std::sqrt(VarianceHidden(ratio));
    least_ratio = std::min(least_ratio, ratio);
  }
  out.shared = square > 0 ? SharedAlong(least_ratio) : 1;
  return out;
}

}  // namespace

double NoiseSigma(const Volume& volume, const Mask& use) {
  const NoiseSeen seen = SeenIn(volume, use);
  return std::max(seen.floor, seen.sigma);
}

double VoxelsSharingNoise(const Volume& volume) {
  constexpr double kOfCube = 1.5;  // half-way, by factors, between every voxel and every cube of shared noise
  constexpr double kNoise = 2;     // floors from which on it is noise, and not anatomy
  const NoiseSeen seen = SeenIn(volume, {});
  if (seen.floor <= 0) return 1;
  const double noise = std::clamp((seen.sigma / seen.floor - 1) / (kNoise - 1), 0.0, 1.0);
  return std::pow(seen.shared, kOfCube * noise);
}

}  // namespace kvx
