// One bone after the other, in the box that it reaches.
#include "pipeline/registration/result/nearest_bones.h"

#include <algorithm>
#include <limits>

#include "core/voxels/distance_map.h"

namespace kvx {
namespace {

// Of two voxels along each axis, a bone's where one of them is.
LabelMap Halved(const LabelMap& labels, const WorkRegion& region) {
  const LabelMap fine = Crop(labels, region);
  LabelMap out(Coarsened(region.grid, 2));
  ParallelEach(out.values.size(), [&](size_t c) {
    const Eigen::Vector3i first = 2 * out.grid.Ijk(c);
    for (int n = 0; n < 8 && !out.values[c]; ++n)
      out.values[c] = fine(first.x() + (n & 1), first.y() + (n >> 1 & 1), first.z() + (n >> 2));
  });
  return out;
}

struct Distances {
  float first_mm = std::numeric_limits<float>::max(), second_mm = std::numeric_limits<float>::max();
};

void Insert(int bone, float distance_mm, NearestBones& nearest, Distances& known) {
  if (distance_mm < known.first_mm) {
    nearest = {int16_t(bone), nearest.first, known.first_mm};
    known = {distance_mm, known.first_mm};
  } else if (distance_mm < known.second_mm) {
    nearest.second = int16_t(bone), nearest.second_mm = known.second_mm = distance_mm;
  }
}

}  // namespace

Image<NearestBones> NearestBonesAt(const BoneSet& bones, const WorkRegion& region, double reach_mm) {
  const LabelMap labels = Halved(bones.labels, region);
  std::vector<Volume> distances(bones.bones.size());
  ParallelFor(distances.size(), [&](size_t b) {
    const int label = bones.bones[b].label;
    if (std::ranges::find(labels.values, uint16_t(label)) != labels.values.end())
      distances[b] = SignedDistance(labels, label, reach_mm);
  });
  Image<NearestBones> out(labels.grid);
  std::vector<Distances> known(out.values.size());
  for (size_t b = 0; b < distances.size(); ++b) {
    const Grid& box = distances[b].grid;
    if (distances[b].values.empty()) continue;
    const Eigen::Vector3i low = labels.grid.ToVox(box.origin).ijk.array().round().cast<int>();
    for (size_t v = 0; v < distances[b].values.size(); ++v) {
      const Eigen::Vector3i p = box.Ijk(v) + low;
      const float distance_mm = distances[b].values[v];
      if (distance_mm > reach_mm || !labels.grid.Contains(p)) continue;
      const size_t at = labels.grid.Index(p.x(), p.y(), p.z());
      Insert(int(b), distance_mm, out.values[at], known[at]);
    }
  }
  return out;
}

}  // namespace kvx
