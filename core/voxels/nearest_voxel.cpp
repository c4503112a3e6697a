// Separable exact distance transform (lower envelopes of parabolas, Felzenszwalb and Huttenlocher 2012) that
// carries the nearest voxel along.
#include "core/voxels/nearest_voxel.h"

#include <algorithm>
#include <limits>

#include "core/host/parallel.h"
#include "core/voxels/grid_lines.h"

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

class Bundle {
 public:
  explicit Bundle(int length) : line_(length), squared_(kLines * length), nearest_(kLines * length) {}

  // Of `lines` lines side by side, of the first of which these are the first voxel.
  void Pass(float* squared, uint32_t* nearest, size_t stride, size_t lines, double spacing) {
    const size_t length = line_.squared.size();
    for (size_t q = 0; q < length; ++q) {
      std::copy_n(squared + q * stride, lines, &squared_[q * kLines]);
      std::copy_n(nearest + q * stride, lines, &nearest_[q * kLines]);
    }
    for (size_t n = 0; n < lines; ++n) PassLine(n, spacing);
    for (size_t q = 0; q < length; ++q) {
      std::copy_n(&squared_[q * kLines], lines, squared + q * stride);
      std::copy_n(&nearest_[q * kLines], lines, nearest + q * stride);
    }
  }

 private:
  static constexpr size_t kLines = LinesSideBySide::kMost;

  void PassLine(size_t n, double spacing) {
    const int length = int(line_.squared.size());
    bool marked = true;
    for (int q = 0; q < length; ++q) {
      line_.squared[q] = squared_[q * kLines + n], line_.nearest[q] = nearest_[q * kLines + n];
      marked = marked && line_.squared[q] == 0;
    }
    if (marked) return;  // every voxel is its own nearest
    const int count = line_.FindEnvelope(spacing);
    for (int q = 0, s = 0; q < length && count > 0; ++q) {
      while (s + 1 < count && line_.from[s + 1] < q * spacing) ++s;
      const double away = (q - line_.site[s]) * spacing;
      squared_[q * kLines + n] = float(away * away + line_.squared[line_.site[s]]);
      nearest_[q * kLines + n] = line_.nearest[line_.site[s]];
    }
  }

  Line line_;
  std::vector<float> squared_;  // voxel by voxel of all lines
  std::vector<uint32_t> nearest_;
};

// Along the second axis or the third.
void PassAlong(const Grid& grid, int axis, std::vector<float>& squared, std::vector<uint32_t>& nearest) {
  const LinesSideBySide bundles(grid, axis);
  ParallelRanges(bundles.count, [&](size_t begin, size_t end) {
    Bundle bundle(bundles.lines.length);
    for (size_t b = begin; b < end; ++b) {
      const size_t first = bundles.First(b);
      bundle.Pass(&squared[first], &nearest[first], bundles.lines.stride, bundles.LinesOf(b),
                  grid.spacing_mm[axis]);
    }
  });
}

// The first pass, along the first axis: of two voxels as near the one before, as between parabolas.
void PassAlongRow(const uint8_t* marked, size_t start, int count, double spacing, float* squared,
                  uint32_t* nearest) {
  for (int from = 0, last = -1; from < count; from = last + 1) {  // last: marked, or -1
    int next = from;
    while (next < count && !marked[next]) ++next;
    if (last < 0 && next == count) return;  // none in this row
    for (int q = from; q < std::min(next + 1, count); ++q) {
      const bool before = next == count || (last >= 0 && q - last <= next - q);
      const double away = (q - (before ? last : next)) * spacing;
      squared[q] = float(away * away);
      nearest[q] = uint32_t(start) + uint32_t(before ? last : next);
    }
    last = next;
  }
}

}  // namespace

std::vector<uint32_t> NearestMarked(const Mask& mask) {
  std::vector<float> squared(mask.values.size(), kFar);
  std::vector<uint32_t> nearest(mask.values.size(), 0);
  const GridLines rows(mask.grid, 0);
  ParallelEach(rows.count, [&](size_t row) {
    const size_t start = rows.First(row);
    PassAlongRow(&mask.values[start], start, rows.length, mask.grid.spacing_mm.x(), &squared[start],
                 &nearest[start]);
  });
  for (int axis = 1; axis < 3; ++axis) PassAlong(mask.grid, axis, squared, nearest);
  return nearest;
}

}  // namespace kvx
