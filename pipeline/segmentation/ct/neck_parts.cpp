// Parts are basins of the depth below the surface, merged from the deepest voxel outwards.
#include "pipeline/segmentation/ct/neck_parts.h"

#include <algorithm>

#include "core/voxels/components.h"
#include "core/voxels/distance_transform.h"
#include "core/voxels/neighbours.h"

namespace kvx {
namespace {

constexpr double kNeck = 0.7;       // of the thinner part's depth: thicker is no neck
constexpr double kMostOfBall = 60;  // mm3 over mm of depth cubed: 4.2 of a ball, some 40 of a shaft of bone

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

}  // namespace

NeckParts PartAtNecks(const Mask& mask) {
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
  NeckParts parts{std::move(place), {0.0f}};
  std::ranges::fill(parts.part.values, 0);
  for (int32_t n = 0; n < count; ++n) {
    const int32_t root = basins.Root(n);
    if (number[root] == 0) {
      number[root] = int32_t(parts.depth_mm.size());
      parts.depth_mm.push_back(depths.mm[root]);
    }
    parts.part.values[depths.voxel[n]] = number[root];
  }
  return parts;
}

bool IsSolid(double mm3, double depth_mm) { return mm3 < kMostOfBall * depth_mm * depth_mm * depth_mm; }

}  // namespace kvx
