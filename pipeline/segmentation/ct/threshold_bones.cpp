// Otsu's threshold finds bone, and the mean intensity on its surface, weighted by the gradient (Kittler et
// al. 1985), its level: about half way up the slope. Parts are basins of the depth below the surface, merged
// from the deepest voxel outwards.
#include "pipeline/segmentation/ct/threshold_bones.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/errors.h"
#include "core/voxels/components.h"
#include "core/voxels/distance_transform.h"
#include "pipeline/scans/air_level.h"

namespace kvx {
namespace {

constexpr float kLeastHu = -200, kMostHu = 1500;  // air and metal say nothing about bone
constexpr float kFatHu = -50;                     // much fat beside little bone would be a class of its own
constexpr double kLeastPieceMm3 = 200;
constexpr double kNeck = 0.7;  // of the thinner part's depth: thicker is no neck

Mask Above(const Volume& scan, double level_hu) {
  Mask mask(scan.grid);
  for (size_t v = 0; v < mask.values.size(); ++v) mask.values[v] = scan.values[v] > level_hu;
  return mask;
}

// The voxels of a mask, deepest first.
struct Depths {
  std::vector<size_t> voxel;
  std::vector<float> mm;
};

Depths DeepestFirst(const Mask& mask) {
  const Volume depth_mm = DistanceMapMm(Complement(mask));
  Depths depths;
  for (size_t v = 0; v < mask.values.size(); ++v) {
    if (mask.values[v]) depths.voxel.push_back(v);
  }
  std::stable_sort(depths.voxel.begin(), depths.voxel.end(),
                   [&](size_t a, size_t b) { return depth_mm.values[a] > depth_mm.values[b]; });
  for (const size_t v : depths.voxel) depths.mm.push_back(depth_mm.values[v]);
  return depths;
}

// Sets of voxels, each known by its place in the order of depths; the root of a set is its deepest.
class Basins {
 public:
  Basins(const std::vector<float>& depth_mm, double voxel_mm)
      : depth_mm_(depth_mm), voxel_mm_(voxel_mm), parent_(depth_mm.size()) {}

  void Found(int32_t v) { parent_[v] = v; }
  void Join(int32_t v, int32_t to) { parent_[v] = Root(to); }
  int32_t Root(int32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  // Two basins that meet at a voxel become one unless there is a neck.
  void Meet(int32_t a, int32_t b, float at_depth_mm) {
    const int32_t roots[] = {Root(a), Root(b)};
    if (roots[0] == roots[1]) return;
    const int32_t deep = std::min(roots[0], roots[1]), thin = std::max(roots[0], roots[1]);
    if (at_depth_mm >= kNeck * depth_mm_[thin] || depth_mm_[thin] - at_depth_mm < voxel_mm_)
      parent_[thin] = deep;
  }

 private:
  const std::vector<float>& depth_mm_;
  double voxel_mm_;
  std::vector<int32_t> parent_;
};

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
    if (v > kFatHu) dense.push_back(std::min(v, kMostHu));
  }
  if (dense.empty())
    throw InputError("the scan shows nothing denser than fat; is it a CT in Hounsfield units?");
  return LevelOfSurface(scan, OtsuThreshold(dense));
}

Image<int32_t> PartAtNecks(const Mask& mask) {
  const Depths depths = DeepestFirst(mask);
  Basins basins(depths.mm, mask.grid.MeanSpacingMm());
  Image<int32_t> place(mask.grid, -1);
  const int32_t count = int32_t(depths.voxel.size());
  for (int32_t n = 0; n < count; ++n) {
    int32_t first = -1;
    ForEachNeighbour(mask.grid, depths.voxel[n], [&](size_t next) {
      if (place.values[next] < 0) return;
      if (first >= 0) return basins.Meet(first, place.values[next], depths.mm[n]);
      first = place.values[next];
    });
    place.values[depths.voxel[n]] = n;
    if (first < 0)
      basins.Found(n);
    else
      basins.Join(n, first);
  }
  std::vector<int32_t> number(size_t(count), 0);
  int32_t parts = 0;
  Image<int32_t> part = std::move(place);
  std::ranges::fill(part.values, 0);
  for (int32_t n = 0; n < count; ++n) {
    int32_t& of_root = number[basins.Root(n)];
    part.values[depths.voxel[n]] = of_root = of_root == 0 ? ++parts : of_root;
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
