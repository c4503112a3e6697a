// The recursive prefilter and the 64 taps.
#include "core/cubic_spline.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/grid_lines.h"
#include "core/parallel.h"

namespace kvx {
namespace {

// Samples of one line become the coefficients of the spline that runs through them (one causal and one
// anticausal pass, pole sqrt(3) - 2).
void PrefilterLine(float* line, int count, size_t stride, std::vector<double>& work) {
  if (count < 2) return;
  const double pole = std::sqrt(3.0) - 2.0;
  work.resize(count);
  for (int i = 0; i < count; ++i) work[i] = 6.0 * line[i * stride];
  double power = pole;
  const std::vector<double> samples = work;
  for (int n = 1; n < 30; ++n, power *= pole) {
    const int i = n % (2 * count - 2);
    work[0] += power * samples[i < count ? i : 2 * count - 2 - i];  // mirrored
  }
  for (int i = 1; i < count; ++i) work[i] += pole * work[i - 1];
  work[count - 1] = pole / (pole * pole - 1) * (work[count - 1] + pole * work[count - 2]);
  for (int i = count - 2; i >= 0; --i) work[i] = pole * (work[i + 1] - work[i]);
  for (int i = 0; i < count; ++i) line[i * stride] = float(work[i]);
}

void PrefilterAlong(Volume& volume, int axis) {
  const GridLines lines(volume.grid, axis);
  ParallelRanges(lines.count, [&](size_t begin, size_t end) {
    std::vector<double> work;
    for (size_t l = begin; l < end; ++l)
      PrefilterLine(&volume.values[lines.First(l)], lines.length, lines.stride, work);
  });
}

}  // namespace

int MirroredVoxel(int at, int size) {
  if (at < 0) at = -at;
  if (at > size - 1) at = 2 * (size - 1) - at;
  return std::clamp(at, 0, size - 1);
}

Volume SplineCoefficients(Volume image) {
  for (int axis = 0; axis < 3; ++axis) PrefilterAlong(image, axis);
  return image;
}

SplineTaps::SplineTaps(double p, int size) {
  const int low = std::clamp(int(p), 0, std::max(0, size - 2));
  const double f = p - low, g = 1 - f;
  const double weights[4] = {g * g * g / 6, (4 - 6 * f * f + 3 * f * f * f) / 6,
                             (4 - 6 * g * g + 3 * g * g * g) / 6, f * f * f / 6};
  const double slopes[4] = {-0.5 * g * g, -2 * f + 1.5 * f * f, 2 * g - 1.5 * g * g, 0.5 * f * f};
  const bool inner = low >= 1 && low + 2 < size;
  for (int n = 0; n < 4; ++n) {
    at[n] = inner ? low - 1 + n : MirroredVoxel(low - 1 + n, size);
    weight[n] = weights[n], slope[n] = slopes[n];
  }
}

float SampleSpline(const Volume& coefficients, const PointVox& p, float outside) {
  const Grid& grid = coefficients.grid;
  if (!grid.Contains(p)) return outside;
  const SplineTaps x(p.ijk.x(), grid.size.x()), y(p.ijk.y(), grid.size.y()), z(p.ijk.z(), grid.size.z());
  double value = 0;
  for (int k = 0; k < 4; ++k) {
    double plane = 0;
    for (int j = 0; j < 4; ++j) {
      const float* row = coefficients.values.data() + grid.Index(0, y.at[j], z.at[k]);
      double line = 0;
      for (int i = 0; i < 4; ++i) line += x.weight[i] * row[x.at[i]];
      plane += y.weight[j] * line;
    }
    value += z.weight[k] * plane;
  }
  return float(value);
}

}  // namespace kvx
