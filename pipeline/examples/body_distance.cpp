// Exact separable squared distances, each axis searched only as far as `reach_mm`.
#include "pipeline/examples/body_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kvx {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

void RelaxLine(float* values, size_t stride, int length, double spacing_mm, int reach,
               std::vector<float>& line) {
  bool any = false, all = true;
  for (int i = 0; i < length; ++i) {
    line[i] = values[i * stride];
    any |= line[i] < kFar;
    all &= line[i] == 0.0f;
  }
  if (!any || all) return;
  for (int i = 0; i < length; ++i) {
    float best = line[i];
    for (int step = 1; step <= reach; ++step) {
      const float cost = float(step * spacing_mm * step * spacing_mm);
      if (cost >= best) break;
      if (i >= step) best = std::min(best, line[i - step] + cost);
      if (i + step < length) best = std::min(best, line[i + step] + cost);
    }
    values[i * stride] = best;
  }
}

}  // namespace

std::vector<float> DistanceToBodyMm(const Mask& body, double reach_mm) {
  const Eigen::Vector3i n = body.grid.size;
  std::vector<float> squared(body.values.size());
  for (size_t v = 0; v < squared.size(); ++v) squared[v] = body.values[v] ? 0.0f : kFar;
  std::vector<float> line(n.maxCoeff());
  const size_t strides[3] = {1, size_t(n.x()), size_t(n.x()) * n.y()};
  for (int axis = 0; axis < 3; ++axis) {
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    const int reach = int(std::ceil(reach_mm / body.grid.spacing_mm[axis]));
    for (int q = 0; q < n[b]; ++q) {
      for (int p = 0; p < n[a]; ++p) {
        RelaxLine(&squared[p * strides[a] + q * strides[b]], strides[axis], n[axis],
                  body.grid.spacing_mm[axis], reach, line);
      }
    }
  }
  for (float& value : squared) value = std::sqrt(value);
  return squared;
}

}  // namespace kvx
