// Separable exact distance transform (lower envelopes of parabolas, Felzenszwalb and Huttenlocher 2012) that
// carries the nearest voxel along.
#include "core/nearest_voxel.h"

#include <limits>

#include "core/grid_lines.h"
#include "core/parallel.h"

namespace kvx {
namespace {

constexpr float kFar = std::numeric_limits<float>::max();

// One line of the volume along an axis: squared distances so far, and to which voxel.
struct Line {
  std::vector<float> squared;
  std::vector<uint32_t> nearest;
  std::vector<int> site;     // the parabolas of the lower envelope
  std::vector<double> from;  // where each begins to be the lowest
  explicit Line(int n) : squared(n), nearest(n), site(n), from(n) {}

  // How many parabolas the envelope has.
  int FindEnvelope(double spacing) {
    int top = -1;
    for (int q = 0; q < int(squared.size()); ++q) {
      if (squared[q] == kFar) continue;
      double start = -std::numeric_limits<double>::infinity();
      while (top >= 0) {
        const int p = site[top];
        const double width = (q - p) * spacing;
        start = 0.5 * (q + p) * spacing + (double(squared[q]) - double(squared[p])) / (2 * width);
        if (start > from[top]) break;
        --top;
        start = -std::numeric_limits<double>::infinity();
      }
      site[++top] = q;
      from[top] = start;
    }
    return top + 1;
  }
};

void PassAlong(const Grid& grid, int axis, std::vector<float>& squared, std::vector<uint32_t>& nearest) {
  const GridLines lines(grid, axis);
  const int n = lines.length;
  const size_t stride = lines.stride;
  const double spacing = grid.spacing_mm[axis];
  ParallelRanges(lines.count, [&](size_t begin, size_t end) {
    Line line(n);
    for (size_t l = begin; l < end; ++l) {
      const size_t start = lines.First(l);
      for (int q = 0; q < n; ++q) {
        line.squared[q] = squared[start + q * stride];
        line.nearest[q] = nearest[start + q * stride];
      }
      const int count = line.FindEnvelope(spacing);
      for (int q = 0, s = 0; q < n && count > 0; ++q) {
        while (s + 1 < count && line.from[s + 1] < q * spacing) ++s;
        const double away = (q - line.site[s]) * spacing;
        squared[start + q * stride] = float(away * away + line.squared[line.site[s]]);
        nearest[start + q * stride] = line.nearest[line.site[s]];
      }
    }
  });
}

}  // namespace

std::vector<uint32_t> NearestMarked(const Mask& mask) {
  std::vector<float> squared(mask.values.size(), kFar);
  std::vector<uint32_t> nearest(mask.values.size(), 0);
  for (size_t v = 0; v < mask.values.size(); ++v) {
    if (mask.values[v]) squared[v] = 0.0f, nearest[v] = uint32_t(v);
  }
  for (int axis = 0; axis < 3; ++axis) PassAlong(mask.grid, axis, squared, nearest);
  return nearest;
}

}  // namespace kvx
