// The recursive prefilter and the 64 taps.
#include "pipeline/scans/cubic_image.h"

#include <algorithm>

#include "core/finer_grid.h"
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
  const Eigen::Vector3i& size = volume.grid.size;
  const size_t strides[3] = {1, size_t(size.x()), size_t(size.x()) * size_t(size.y())};
  const int across = axis == 0 ? 1 : 0, slow = axis == 2 ? 1 : 2;
  ParallelRanges(size_t(size[slow]), [&](size_t begin, size_t end) {
    std::vector<double> work;
    for (size_t s = begin; s < end; ++s) {
      for (int a = 0; a < size[across]; ++a) {
        float* line = volume.values.data() + s * strides[slow] + size_t(a) * strides[across];
        PrefilterLine(line, size[axis], strides[axis], work);
      }
    }
  });
}

int Mirrored(int at, int size) {
  if (at < 0) at = -at;
  if (at > size - 1) at = 2 * (size - 1) - at;
  return std::clamp(at, 0, size - 1);
}

// What the cubic through the neighbouring slices does not tell of each voxel, squared; empty without thick
// slices. More than is missed between two slices, which are closer; but neighbouring places miss the same.
Volume MissedVarianceOf(const Volume& volume) {
  const Eigen::Vector3i times = TimesTowardsCubes(volume.grid), &size = volume.grid.size;
  if ((times.array() == 1).all()) return {};
  Volume out(volume.grid);
  ParallelRanges(out.values.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      for (int a = 0; a < 3; ++a) {
        if (times[a] == 1) continue;
        const Eigen::Vector3i p = volume.grid.Ijk(v);
        const auto beside = [&](int slices) {
          Eigen::Vector3i q = p;
          q[a] = Mirrored(p[a] + slices, size[a]);
          return volume(q.x(), q.y(), q.z());
        };
        const float told = (9 * (beside(1) + beside(-1)) - (beside(3) + beside(-3))) / 16;
        out.values[v] += (volume.values[v] - told) * (volume.values[v] - told);
      }
    }
  });
  return out;
}

struct Taps {
  int at[4];
  double weight[4], slope[4];
};

Taps TapsAt(double p, int size) {
  Taps taps;
  const int low = std::clamp(int(p), 0, std::max(0, size - 2));
  const double f = p - low, g = 1 - f;
  const double weight[4] = {g * g * g / 6, (4 - 6 * f * f + 3 * f * f * f) / 6,
                            (4 - 6 * g * g + 3 * g * g * g) / 6, f * f * f / 6};
  const double slope[4] = {-0.5 * g * g, -2 * f + 1.5 * f * f, 2 * g - 1.5 * g * g, 0.5 * f * f};
  for (int n = 0; n < 4; ++n) {
    taps.at[n] = Mirrored(low - 1 + n, size);
    taps.weight[n] = weight[n], taps.slope[n] = slope[n];
  }
  return taps;
}

}  // namespace

CubicImage::CubicImage(const Volume& volume)
    : coefficients_(volume), missed_variance_(MissedVarianceOf(volume)) {
  for (int axis = 0; axis < 3; ++axis) PrefilterAlong(coefficients_, axis);
}

double CubicImage::MissedVariance(const Eigen::Vector3d& p) const {
  return missed_variance_.values.empty() ? 0.0 : SampleTrilinear(missed_variance_, PointVox{p});
}

bool CubicImage::At(const Eigen::Vector3d& p, double& value, Eigen::Vector3d& gradient) const {
  const Grid& grid = coefficients_.grid;
  for (int a = 0; a < 3; ++a) {
    if (!(p[a] >= 0 && p[a] <= grid.size[a] - 1)) return false;
  }
  const Taps x = TapsAt(p.x(), grid.size.x()), y = TapsAt(p.y(), grid.size.y()),
             z = TapsAt(p.z(), grid.size.z());
  value = 0;
  gradient.setZero();
  for (int k = 0; k < 4; ++k) {
    double plane = 0, plane_dx = 0, plane_dy = 0;
    for (int j = 0; j < 4; ++j) {
      const float* row = coefficients_.values.data() + grid.Index(0, y.at[j], z.at[k]);
      double line = 0, line_dx = 0;
      for (int i = 0; i < 4; ++i) {
        const double c = row[x.at[i]];
        line += x.weight[i] * c;
        line_dx += x.slope[i] * c;
      }
      plane += y.weight[j] * line;
      plane_dx += y.weight[j] * line_dx;
      plane_dy += y.slope[j] * line;
    }
    value += z.weight[k] * plane;
    gradient += Eigen::Vector3d(z.weight[k] * plane_dx, z.weight[k] * plane_dy, z.slope[k] * plane);
  }
  return true;
}

}  // namespace kvx
