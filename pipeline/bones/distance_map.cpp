// Separable squared distance transform by lower envelopes of parabolas.
#include "pipeline/bones/distance_map.h"

#include <limits>

namespace kvx {
namespace {

constexpr double kFar = 1e12;

// d[i] = min_j f[j] + (step (i - j))^2 along one line.
void TransformLine(std::vector<double>& f, double step, std::vector<int>& site, std::vector<double>& from,
                   std::vector<double>& out) {
  const int n = int(f.size());
  int last = 0;
  site[0] = 0;
  from[0] = -std::numeric_limits<double>::infinity();
  from[1] = std::numeric_limits<double>::infinity();
  const auto crossing = [&](int a, int b) {  // where parabola b (right of a) becomes the lower one
    return ((f[b] + step * step * b * b) - (f[a] + step * step * a * a)) / (2 * step * step * (b - a));
  };
  for (int j = 1; j < n; ++j) {
    double x = crossing(site[last], j);
    while (last > 0 && x <= from[last]) x = crossing(site[--last], j);
    site[++last] = j;
    from[last] = x;
    from[last + 1] = std::numeric_limits<double>::infinity();
  }
  for (int i = 0, k = 0; i < n; ++i) {
    while (from[k + 1] < i) ++k;
    const double d = step * (i - site[k]);
    out[i] = d * d + f[site[k]];
  }
  f.swap(out);
}

void TransformAxis(Image<double>& squared, int axis) {
  const Grid& grid = squared.grid;
  const int n = grid.size[axis];
  const size_t stride = axis == 0   ? 1
                        : axis == 1 ? size_t(grid.size.x())
                                    : size_t(grid.size.x()) * grid.size.y();
  std::vector<double> line(n), out(n), from(n + 1);
  std::vector<int> site(n);
  for (size_t v = 0; v < squared.values.size(); ++v) {
    if (grid.Ijk(v)[axis] != 0) continue;
    for (int i = 0; i < n; ++i) line[i] = squared.values[v + i * stride];
    TransformLine(line, grid.spacing_mm[axis], site, from, out);
    for (int i = 0; i < n; ++i) squared.values[v + i * stride] = line[i];
  }
}

// Squared mm to the nearest voxel that is (or is not) the bone.
Image<double> SquaredDistance(const Mask& bone, bool to_bone) {
  Image<double> squared(bone.grid);
  for (size_t v = 0; v < squared.values.size(); ++v)
    squared.values[v] = (bone.values[v] != 0) == to_bone ? 0 : kFar;
  for (int axis = 0; axis < 3; ++axis) TransformAxis(squared, axis);
  return squared;
}

Mask CropOf(const LabelMap& labels, int label, double margin_mm) {
  const Grid& grid = labels.grid;
  Eigen::Vector3i low = grid.size, high = -Eigen::Vector3i::Ones();
  for (size_t v = 0; v < labels.values.size(); ++v) {
    if (labels.values[v] != label) continue;
    low = low.cwiseMin(grid.Ijk(v));
    high = high.cwiseMax(grid.Ijk(v));
  }
  const Eigen::Vector3i pad = (margin_mm / grid.spacing_mm.array()).ceil().cast<int>().matrix();
  low -= pad, high += pad;  // may leave the grid: the world goes on there
  Grid crop = grid;
  crop.size = high - low + Eigen::Vector3i::Ones();
  crop.origin = grid.ToMm(PointVox{low.cast<double>()});
  Mask bone(crop);
  for (size_t v = 0; v < bone.values.size(); ++v) {
    const Eigen::Vector3i at = crop.Ijk(v) + low;
    bone.values[v] = grid.Contains(at) && labels(at.x(), at.y(), at.z()) == label;
  }
  return bone;
}

}  // namespace

Volume SignedDistance(const LabelMap& labels, int label, double margin_mm) {
  const Mask bone = CropOf(labels, label, margin_mm);
  const Image<double> outside = SquaredDistance(bone, true), inside = SquaredDistance(bone, false);
  const double half_voxel_mm = 0.5 * bone.grid.MeanSpacingMm();
  Volume out(bone.grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    out.values[v] = bone.values[v] ? float(half_voxel_mm - std::sqrt(inside.values[v]))
                                   : float(std::sqrt(outside.values[v]) - half_voxel_mm);
  }
  return out;
}

}  // namespace kvx
