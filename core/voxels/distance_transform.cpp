// Separable: along rows to the nearest set voxel, then a pass of lower envelopes of parabolas per axis, each
// in the axis' own millimetres. A parabola that begins beyond the reach is beyond it everywhere and left out.
#include "core/voxels/distance_transform.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/host/parallel.h"
#include "core/voxels/grid_lines.h"

namespace kvx {
namespace {

constexpr float kUnseen = kNoVoxelInSight;  // also what it is as a float

// Squared, with room for rounding: a voxel just at the reach is within it.
double BeyondReach(double reach_mm) { return std::min(double(kUnseen), reach_mm * reach_mm * (1 + 1e-5)); }

// The lower envelope of x -> d[q] + (x - q)^2 spacing^2 over the positions q of each of some lines.
template <class T>
class LineEnvelopes {
 public:
  // Values from `beyond` on are out of sight.
  LineEnvelopes(int length, double beyond)
      : beyond_(beyond), where_(length), from_(length + 1), line_(length), values_(kLines * size_t(length)) {}

  // Of `lines` lines side by side, the first of which begins at `values`.
  void Transform(T* values, size_t stride, size_t lines, double spacing_mm) {
    for (size_t q = 0; q < line_.size(); ++q) std::copy_n(values + q * stride, lines, &values_[q * kLines]);
    bool changed = false;
    for (size_t n = 0; n < lines; ++n) changed |= TransformLine(&values_[n], spacing_mm * spacing_mm);
    for (size_t q = 0; changed && q < line_.size(); ++q)
      std::copy_n(&values_[q * kLines], lines, values + q * stride);
  }

 private:
  static constexpr size_t kLines = LinesSideBySide::kMost;

  // False where it stays as it is.
  bool TransformLine(T* values, double step2) {
    const int count = int(line_.size());
    bool zero = true;
    for (int q = 0; q < count; ++q) line_[q] = values[size_t(q) * kLines], zero = zero && line_[q] == 0;
    if (zero) return false;  // as most lines of most sets are
    const int last = Build(count, step2);
    for (int x = 0, k = 0; x < count && last >= 0; ++x) {
      while (k < last && from_[k + 1] < x) ++k;
      const double d = x - where_[k];
      values[size_t(x) * kLines] = T(line_[where_[k]] + d * d * step2);
    }
    return last >= 0;
  }
  // Returns the last parabola's place, -1 without any.
  int Build(int count, double step2) {
    int k = -1;
    for (int q = 0; q < count; ++q) {
      if (line_[q] >= beyond_) continue;
      double begin = -std::numeric_limits<double>::infinity();
      while (k >= 0 && (begin = Crossing(where_[k], q, step2)) <= from_[k]) --k;
      if (k < 0) begin = -std::numeric_limits<double>::infinity();
      where_[++k] = q;
      from_[k] = begin;
    }
    return k;
  }
  double Crossing(int p, int q, double step2) const {
    return (line_[q] - line_[p] + step2 * (double(q) * q - double(p) * p)) / (2 * step2 * (q - p));
  }

  double beyond_;
  std::vector<int> where_;
  std::vector<double> from_, line_;
  std::vector<T> values_;  // voxel by voxel of all lines
};

// Along the first axis, to the nearest set voxel of the same row.
template <class T>
void TransformRow(const uint8_t* set, int count, double spacing_mm, T* out) {
  const double step2 = spacing_mm * spacing_mm;
  for (int from = 0, last = -1; from < count; from = last + 1) {  // last: set, or -1
    int next = from;
    while (next < count && !set[next]) ++next;
    for (int x = from; x < next; ++x) {
      const double before = last < 0 ? kNoVoxelInSight : x - last,
                   after = next < count ? next - x : kNoVoxelInSight;
      const double d = std::min(before, after);
      out[x] = d < kNoVoxelInSight ? T(d * d * step2) : T(kNoVoxelInSight);
    }
    if (next < count) out[next] = T(0);
    last = next;
  }
}

template <class T>
Image<T> Squared(const Mask& set, double reach_mm) {
  const Grid& grid = set.grid;
  const double beyond = BeyondReach(reach_mm);
  Image<T> out(grid);
  const GridLines rows(grid, 0);
  ParallelEach(rows.count, [&](size_t row) {
    const size_t first = rows.First(row);
    TransformRow(&set.values[first], rows.length, grid.spacing_mm.x(), &out.values[first]);
  });
  for (int axis = 1; axis < 3; ++axis) {
    const LinesSideBySide bundles(grid, axis);
    ParallelRanges(bundles.count, [&](size_t begin, size_t end) {
      LineEnvelopes<T> envelopes(bundles.lines.length, beyond);
      for (size_t b = begin; b < end; ++b) {
        envelopes.Transform(&out.values[bundles.First(b)], bundles.lines.stride, bundles.LinesOf(b),
                            grid.spacing_mm[axis]);
      }
    });
  }
  return out;
}

}  // namespace

Image<double> SquaredDistanceMm(const Mask& set, double reach_mm) { return Squared<double>(set, reach_mm); }

Volume DistanceMapMm(const Mask& set, double reach_mm) {
  Volume out = Squared<float>(set, reach_mm);
  ParallelEach(out.values.size(), [&](size_t v) { out.values[v] = std::sqrt(out.values[v]); });
  return out;
}

}  // namespace kvx
