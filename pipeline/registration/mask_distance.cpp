// Separable lower envelopes of parabolas (Felzenszwalb and Huttenlocher 2012), one axis after the other.
#include "pipeline/registration/mask_distance.h"

#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace kvx {
namespace {

constexpr float kFar = 1e12f;

// squared[i] <- min_j squared[j] + (spacing (i - j))^2 along one line.
class LineTransform {
 public:
  LineTransform(int length, double spacing)
      : spacing2_(spacing * spacing), in_(length), apex_(length), from_(length + 1) {}

  void operator()(float* line, size_t stride) {
    const int n = int(in_.size());
    for (int i = 0; i < n; ++i) in_[i] = line[i * stride];
    int last = -1;
    for (int i = 0; i < n; ++i) {
      if (in_[i] >= kFar) continue;
      double start = -std::numeric_limits<double>::infinity();
      while (last >= 0 && (start = Crossing(apex_[last], i)) <= from_[last]) --last;
      if (last < 0) start = -std::numeric_limits<double>::infinity();
      apex_[++last] = i;
      from_[last] = start;
    }
    if (last < 0) return;
    for (int i = 0, k = 0; i < n; ++i) {
      while (k < last && from_[k + 1] <= i) ++k;
      line[i * stride] = float(in_[apex_[k]] + spacing2_ * (i - apex_[k]) * (i - apex_[k]));
    }
  }

 private:
  double Crossing(int a, int b) const {
    return ((in_[b] - in_[a]) / spacing2_ + double(b) * b - double(a) * a) / (2.0 * (b - a));
  }
  double spacing2_;
  std::vector<double> in_;
  std::vector<int> apex_;
  std::vector<double> from_;
};

}  // namespace

Volume DistanceMm(const Mask& set) {
  Volume out(set.grid);
  for (size_t v = 0; v < out.values.size(); ++v) out.values[v] = set.values[v] ? 0.0f : kFar;
  const Eigen::Vector3i size = set.grid.size;
  const size_t strides[3] = {1, size_t(size.x()), size_t(size.x()) * size.y()};
  for (int axis = 0; axis < 3; ++axis) {
    const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
    ParallelRanges(size_t(size[a]) * size[b], [&](size_t begin, size_t end) {
      LineTransform transform(size[axis], set.grid.spacing_mm[axis]);
      for (size_t line = begin; line < end; ++line) {
        transform(out.values.data() + (line % size[a]) * strides[a] + (line / size[a]) * strides[b],
                  strides[axis]);
      }
    });
  }
  for (float& value : out.values) value = std::sqrt(value);
  return out;
}

}  // namespace kvx
