// The recursive prefilter and the 64 taps.
#include "core/voxels/cubic_spline.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/voxels/line_bundles.h"

namespace kvx {
namespace {

using Rows = std::vector<BundleRow<double>>;

// Samples of lines become the coefficients of the splines that run through them (one causal and one
// anticausal pass, pole sqrt(3) - 2).
void Prefilter(Rows& rows) {
  const int count = int(rows.size());
  if (count < 2) return;
  const double pole = std::sqrt(3.0) - 2.0;
  for (BundleRow<double>& row : rows) row *= 6.0;
  double power = pole;
  const BundleRow<double> start = rows[0];
  for (int n = 1; n < 30; ++n, power *= pole) {
    const int i = n % (2 * count - 2), mirrored = i < count ? i : 2 * count - 2 - i;
    rows[0] += power * (mirrored == 0 ? start : rows[mirrored]);
  }
  for (int i = 1; i < count; ++i) rows[i] += pole * rows[i - 1];
  rows[count - 1] = pole / (pole * pole - 1) * (rows[count - 1] + pole * rows[count - 2]);
  for (int i = count - 2; i >= 0; --i) rows[i] = pole * (rows[i + 1] - rows[i]);
}

}  // namespace

int MirroredVoxel(int at, int size) {
  if (at < 0) at = -at;
  if (at > size - 1) at = 2 * (size - 1) - at;
  return std::clamp(at, 0, size - 1);
}

Volume SplineCoefficients(Volume image) {
  for (int axis = 0; axis < 3; ++axis) ForEachLineBundle<double>(image, axis, Prefilter);
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
