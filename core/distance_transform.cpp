// Separable: one pass of lower envelopes of parabolas per axis, each in the axis' own millimetres.
#include "core/distance_transform.h"

#include <array>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace kvx {
namespace {

constexpr float kUnseen = kNoVoxelInSight;  // also what it is as a float

// The lower envelope of x -> d[q] + (x - q)^2 spacing^2 over the positions q of one line.
class LineEnvelope {
 public:
  explicit LineEnvelope(int longest) : where_(longest), from_(longest + 1), line_(longest) {}

  template <class T>
  void Transform(T* values, size_t stride, int count, double spacing_mm) {
    const double step2 = spacing_mm * spacing_mm;
    for (int q = 0; q < count; ++q) line_[q] = values[q * stride];
    const int last = Build(count, step2);
    if (last < 0) return;
    int k = 0;
    for (int x = 0; x < count; ++x) {
      while (k < last && from_[k + 1] < x) ++k;
      const double d = x - where_[k];
      values[x * stride] = T(line_[where_[k]] + d * d * step2);
    }
  }

 private:
  // Returns the last parabola's place, -1 without any.
  int Build(int count, double step2) {
    int k = -1;
    for (int q = 0; q < count; ++q) {
      if (line_[q] >= kUnseen) continue;
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

  std::vector<int> where_;
  std::vector<double> from_, line_;
};

template <class T>
Image<T> Squared(const Mask& set) {
  const Grid& grid = set.grid;
  Image<T> out(grid);
  for (size_t v = 0; v < out.values.size(); ++v) out.values[v] = set.values[v] ? T(0) : T(kNoVoxelInSight);
  const std::array<size_t, 3> stride{1, size_t(grid.size.x()), size_t(grid.size.x()) * grid.size.y()};
  for (int axis = 0; axis < 3; ++axis) {
    const int u = axis == 0 ? 1 : 0, w = axis == 2 ? 1 : 2;
    ParallelRanges(size_t(grid.size[u]) * grid.size[w], [&](size_t begin, size_t end) {
      LineEnvelope envelope(grid.size[axis]);
      for (size_t line = begin; line < end; ++line) {
        const size_t first = line % grid.size[u] * stride[u] + line / grid.size[u] * stride[w];
        envelope.Transform(&out.values[first], stride[axis], grid.size[axis], grid.spacing_mm[axis]);
      }
    });
  }
  return out;
}

}  // namespace

Image<double> SquaredDistanceMm(const Mask& set) { return Squared<double>(set); }

Volume DistanceMapMm(const Mask& set) {
  Volume out = Squared<float>(set);
  for (float& value : out.values) value = std::sqrt(value);
  return out;
}

}  // namespace kvx
