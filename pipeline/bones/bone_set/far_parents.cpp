// Distances between a few hundred voxels of each bone.
#include "pipeline/bones/bone_set/far_parents.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/voxels/label_surface.h"

namespace kvx {
namespace {

constexpr double kMuchNearer = 0.33;    // another bone, times the distance to the parent
constexpr size_t kSurfaceVoxels = 400;  // of a bone

bool HasOneMuchNearer(const BoneSet& bones, const BoneSurfaces& surfaces, int b, double parent_mm) {
  for (int other = 0; other < bones.size(); ++other) {
    if (other == b || bones.bones[size_t(other)].parent == b) continue;
    if (surfaces.ApartMm(b, other) <= kMuchNearer * parent_mm) return true;
  }
  return false;
}

}  // namespace

BoneSurfaces::BoneSurfaces(const BoneSet& bones) : points_mm_(size_t(bones.size())) {
  std::vector<int> bone_of(65536, kNoParent);
  for (int b = 0; b < bones.size(); ++b) bone_of[size_t(bones.bones[size_t(b)].label)] = b;
  for (size_t v = 0; v < bones.labels.values.size(); ++v) {
    const int b = bone_of[bones.labels.values[v]];
    if (b == kNoParent) continue;
    const Eigen::Vector3i at = bones.labels.grid.Ijk(v);
    if (AtSurface(bones.labels, at))
      points_mm_[size_t(b)].push_back(bones.labels.grid.ToMm(PointVox{at.cast<double>()}).lps);
  }
  for (auto& points : points_mm_) {
    const size_t step = points.size() / kSurfaceVoxels + 1;
    size_t kept = 0;
    for (size_t n = 0; n < points.size(); n += step) points[kept++] = points[n];
    points.resize(kept);
  }
}

double BoneSurfaces::ApartMm(int a, int b) const {
  double squared = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& x : points_mm_[size_t(a)]) {
    for (const Eigen::Vector3d& y : points_mm_[size_t(b)]) squared = std::min(squared, (x - y).squaredNorm());
  }
  return std::sqrt(squared);
}

std::vector<FarParent> FarParents(const BoneSet& bones, const BoneSurfaces& surfaces) {
  std::vector<FarParent> far;
  for (int b = 0; b < bones.size(); ++b) {
    const int parent = bones.bones[size_t(b)].parent;
    if (parent == kNoParent) continue;
    const double apart_mm = surfaces.ApartMm(b, parent);
    if (apart_mm > kFarMm && HasOneMuchNearer(bones, surfaces, b, apart_mm)) far.push_back({b, apart_mm});
  }
  return far;
}

}  // namespace kvx
