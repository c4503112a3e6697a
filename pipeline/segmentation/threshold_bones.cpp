// Otsu's threshold finds bone, and the mean intensity on its surface, weighted by the gradient (Kittler et
// al. 1985), its level: about half way up the slope. Parts are basins of the depth below the surface, merged
// from the deepest voxel outwards.
#include "pipeline/segmentation/threshold_bones.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/distance_transform.h"
#include "core/errors.h"
#include "pipeline/skinning/air_level.h"
#include "pipeline/skinning/components.h"

namespace kvx {
namespace {

constexpr float kLeastHu = -200, kMostHu = 1500;  // air and metal say nothing about bone
constexpr double kLeastPieceMm3 = 200;
constexpr double kNeck = 0.7;  // of the thinner part's depth: thicker is no neck

Mask Above(const Volume& scan, double level_hu) {
  Mask mask(scan.grid);
  for (size_t v = 0; v < mask.values.size(); ++v) mask.values[v] = scan.values[v] > level_hu;
  return mask;
}

std::vector<float> DepthMm(const Mask& mask) {
  Mask outside(mask.grid);
  for (size_t v = 0; v < mask.values.size(); ++v) outside.values[v] = !mask.values[v];
  const Image<double> squared = SquaredDistanceMm(outside);
  std::vector<float> depth(squared.values.size());
  for (size_t v = 0; v < depth.size(); ++v) depth[v] = float(std::sqrt(squared.values[v]));
  return depth;
}

// Sets of voxels; the root of a set is its deepest voxel.
class Basins {
 public:
  Basins(const std::vector<float>& depth, double voxel_mm)
      : depth_(depth), voxel_mm_(voxel_mm), parent_(depth.size(), -1) {}

  bool Has(size_t v) const { return parent_[v] >= 0; }
  void Found(size_t v) { parent_[v] = int64_t(v); }
  void Join(size_t v, size_t to) { parent_[v] = Root(to); }
  int64_t Root(size_t v) {
    while (parent_[v] != int64_t(v)) v = size_t(parent_[v] = parent_[size_t(parent_[v])]);
    return int64_t(v);
  }
  // Two basins that meet at a voxel become one unless there is a neck.
  void Meet(size_t a, size_t b, float at_depth) {
    int64_t deep = Root(a), thin = Root(b);
    if (deep == thin) return;
    if (depth_[thin] > depth_[deep]) std::swap(deep, thin);
    if (at_depth >= kNeck * depth_[thin] || depth_[thin] - at_depth < voxel_mm_) parent_[thin] = deep;
  }

 private:
  const std::vector<float>& depth_;
  double voxel_mm_;
  std::vector<int64_t> parent_;
};

std::vector<size_t> DeepestFirst(const Mask& mask, const std::vector<float>& depth) {
  std::vector<size_t> order;
  for (size_t v = 0; v < mask.values.size(); ++v) {
    if (mask.values[v]) order.push_back(v);
  }
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return depth[a] > depth[b]; });
  return order;
}

template <class Visit>
void ForEachNeighbour(const Grid& grid, size_t at, Visit&& visit) {
  const Eigen::Vector3i p = grid.Ijk(at);
  for (int n = 0; n < 27; ++n) {
    const Eigen::Vector3i q = p + Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    if (n != 13 && grid.Contains(q)) visit(grid.Index(q.x(), q.y(), q.z()));
  }
}

// The voxel and those up to two steps away along the axes, in HU; metal counts as dense bone.
struct Cross {
  float here, least, most;
  double slope;  // change per mm
};

Cross CrossAt(const Volume& scan, size_t v) {
  const auto hu = [&](size_t at) { return std::min(scan.values[at], kMostHu); };
  const Eigen::Vector3i p = scan.grid.Ijk(v);
  Cross cross{hu(v), hu(v), hu(v), 0};
  size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = scan.grid.size[axis] - 1;
    for (const int step : {-2, -1, 1, 2}) {
      if (p[axis] + step < 0 || p[axis] + step > last) continue;
      const float there = hu(v + size_t(step) * stride);
      cross.least = std::min(cross.least, there), cross.most = std::max(cross.most, there);
    }
    if (p[axis] > 0 && p[axis] < last) {
      const double change = hu(v + stride) - hu(v - stride);
      cross.slope += std::pow(change / (2 * scan.grid.spacing_mm[axis]), 2);
    }
    stride *= size_t(scan.grid.size[axis]);
  }
  cross.slope = std::sqrt(cross.slope);
  return cross;
}

// Of the voxels near the surface of what is denser than `rough_hu`, away from air.
double LevelOfSurface(const Volume& scan, double rough_hu) {
  double sum = 0, slopes = 0;
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Cross cross = CrossAt(scan, v);
    if (cross.least <= kLeastHu || cross.least > rough_hu || cross.most <= rough_hu) continue;
    sum += cross.slope * cross.here, slopes += cross.slope;
  }
  return slopes > 0 ? sum / slopes : rough_hu;
}

}  // namespace

double FindBoneLevel(const Volume& scan) {
  std::vector<float> dense;
  for (const float v : scan.values) {
    if (v > kLeastHu) dense.push_back(std::min(v, kMostHu));
  }
  if (dense.empty())
    throw InputError("the scan shows nothing denser than air; is it a CT in Hounsfield units?");
  return LevelOfSurface(scan, OtsuThreshold(dense));
}

Image<int32_t> PartAtNecks(const Mask& mask) {
  const std::vector<float> depth = DepthMm(mask);
  Basins basins(depth, mask.grid.MeanSpacingMm());
  const std::vector<size_t> order = DeepestFirst(mask, depth);
  for (const size_t v : order) {
    int64_t first = -1;
    ForEachNeighbour(mask.grid, v, [&](size_t next) {
      if (!basins.Has(next)) return;
      if (first >= 0) return basins.Meet(size_t(first), next, depth[v]);
      first = int64_t(next);
    });
    if (first < 0)
      basins.Found(v);
    else
      basins.Join(v, size_t(first));
  }
  Image<int32_t> part(mask.grid, 0);
  std::vector<int32_t> number(mask.values.size(), 0);
  int32_t count = 0;
  for (const size_t v : order) {
    int32_t& n = number[size_t(basins.Root(v))];
    part.values[v] = n = n == 0 ? ++count : n;
  }
  return part;
}

LabelMap ThresholdBones(const Volume& scan, double level_hu) {
  const Image<int32_t> part = PartAtNecks(FillHoles(Above(scan, level_hu)));
  const int32_t parts = *std::max_element(part.values.begin(), part.values.end());
  std::vector<size_t> voxels(size_t(parts) + 1, 0);
  for (const int32_t p : part.values) ++voxels[size_t(p)];
  std::vector<int32_t> by_size(static_cast<size_t>(parts));
  std::iota(by_size.begin(), by_size.end(), 1);
  std::stable_sort(by_size.begin(), by_size.end(),
                   [&](int32_t a, int32_t b) { return voxels[a] > voxels[b]; });
  std::vector<uint16_t> label_of(size_t(parts) + 1, 0);
  uint16_t label = 0;
  for (const int32_t p : by_size) {
    if (double(voxels[p]) * scan.grid.spacing_mm.prod() >= kLeastPieceMm3 && label < 65000)
      label_of[p] = ++label;
  }
  if (label == 0) throw InputError("nothing is as dense as the threshold; give a lower bones.threshold");
  LabelMap labels(scan.grid);
  for (size_t v = 0; v < labels.values.size(); ++v) labels.values[v] = label_of[part.values[v]];
  return labels;
}

}  // namespace kvx
