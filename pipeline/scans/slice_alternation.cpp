// Medians over the voxels of a slice, then over slices: neither anatomy nor noise takes turns with them.
#include "pipeline/scans/slice_alternation.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"
#include "core/voxels/grid_lines.h"
#include "pipeline/scans/air_level.h"
#include "pipeline/scans/grey_kind.h"

namespace kvx {
namespace {

constexpr double kLeastLogGain = 0.02;  // 4 % from slice to slice
constexpr double kStandsOut = 6;        // standard errors
constexpr size_t kFewestVoxels = 50;    // of a slice, and
constexpr size_t kFewestSlices = 8;     // of these
constexpr int kMostVoxels = 1 << 14;    // looked at of a slice: every so many-th of its rows and columns

int StepWithin(int columns, int rows) {
  int step = 1;
  while (columns / step * (rows / step) > kMostVoxels) ++step;
  return step;
}

// How much brighter, as a logarithm, slice `k` is than the mean of those beside it, over voxels that are
// bright in all three. Nothing where few are.
std::optional<double> RiseOfSlice(const Volume& volume, int axis, int k, float bright) {
  const Eigen::Vector3i& size = volume.grid.size;
  const ptrdiff_t stride = ptrdiff_t(GridLines(volume.grid, axis).stride);
  const int a = (axis + 1) % 3, b = (axis + 2) % 3, step = StepWithin(size[a], size[b]);
  std::vector<double> ratios;
  Eigen::Vector3i at;
  at[axis] = k;
  for (at[b] = 0; at[b] < size[b]; at[b] += step) {
    for (at[a] = 0; at[a] < size[a]; at[a] += step) {
      const float* value = &volume(at.x(), at.y(), at.z());
      const float before = value[-stride], here = *value, after = value[stride];
      if (std::min({before, here, after}) < bright) continue;
      ratios.push_back(double(here) / std::sqrt(double(before) * double(after)));
    }
  }
  if (ratios.size() < kFewestVoxels) return std::nullopt;
  return std::log(TakeMedian(ratios));  // as the median of logarithms, of which there would be many
}

std::optional<double> LogGainAlong(const Volume& volume, int axis, float bright) {
  const size_t slices = size_t(std::max(2, volume.grid.size[axis]));
  std::vector<std::optional<double>> rises(slices - 2);
  ParallelEach(rises.size(), [&](size_t n) { rises[n] = RiseOfSlice(volume, axis, int(n) + 1, bright); });
  std::vector<double> gains;
  for (size_t n = 0; n < rises.size(); ++n) {
    if (rises[n]) gains.push_back((n % 2 ? 0.5 : -0.5) * *rises[n]);  // slice n + 1
  }
  if (gains.size() < kFewestSlices) return std::nullopt;
  const double gain = TakeMedian(gains);
  std::vector<double> off;
  for (const double of_slice : gains) off.push_back(std::abs(of_slice - gain));
  const double error = kSdOfMad * TakeMedian(off) / std::sqrt(double(gains.size()));
  const double least = std::max(kLeastLogGain, kStandsOut * error);
  return std::abs(gain) >= least ? std::optional(gain) : std::nullopt;
}

void DivideOut(const SliceAlternation& found, Volume& volume) {
  const float even = float(std::exp(-found.log_gain)), odd = float(std::exp(found.log_gain));
  ParallelEach(volume.values.size(),
               [&](size_t v) { volume.values[v] *= volume.grid.Ijk(v)[found.axis] % 2 ? odd : even; });
}

}  // namespace

std::optional<SliceAlternation> FindSliceAlternation(const Volume& volume) {
  const float bright = float(OtsuThreshold(volume.values));
  if (bright <= 0) return std::nullopt;
  std::optional<SliceAlternation> strongest;
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<double> gain = LogGainAlong(volume, axis, bright);
    if (gain && (!strongest || std::abs(*gain) > std::abs(strongest->log_gain)))
      strongest = SliceAlternation{axis, *gain};
  }
  return strongest;
}

double EvenSlices(Scan& scan) {
  if (IsHounsfield(scan.volume, scan.modality) || !IsMagnitude(scan.volume)) return 0;
  double most = 0;
  for (int axis = 0; axis < 3; ++axis) {  // at most one each
    const std::optional<SliceAlternation> found = FindSliceAlternation(scan.volume);
    if (!found) break;
    DivideOut(*found, scan.volume);
    most = std::max(most, std::expm1(2 * std::abs(found->log_gain)));
  }
  return most;
}

}  // namespace kvx
