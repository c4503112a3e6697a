// A few hundred voxels of each bone tell which bones are far; what is said of a gap is measured by all of
// them.
#include "pipeline/bones/bone_set/far_parents.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/region_presets.h"
#include "core/voxels/distance_transform.h"
#include "core/voxels/label_mask.h"
#include "core/voxels/label_surface.h"
#include "core/voxels/voxel_box.h"

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

bool MeetInPreset(const Bone& bone, const Bone& parent, Region region) {
  const PresetBone* const of_bone = FindPreset(region, bone.name);
  const PresetBone* const of_parent = FindPreset(region, parent.name);
  return of_bone != nullptr && of_parent != nullptr && of_bone->parent == of_parent->name;
}

// Between the surfaces, at least: voxels' centres may lie inside them by half a voxel each. `within_mm`: the
// bones are no farther apart.
double LeastGapMm(const LabelMap& whole, int label, int other, double within_mm) {
  const LabelMap labels = Cropped(whole, GrownByMm(BoxOf(whole, label), within_mm, whole.grid));
  const Volume from_bone_mm = DistanceMapMm(MaskOfLabel(labels, label));
  double least_mm = within_mm;
  for (size_t v = 0; v < labels.values.size(); ++v)
    if (labels.values[v] == other) least_mm = std::min(least_mm, double(from_bone_mm.values[v]));
  return least_mm - whole.grid.spacing_mm.maxCoeff();
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

std::vector<FarParent> PartedJoints(const BoneSet& bones, const BoneSurfaces& surfaces, Region region) {
  std::vector<FarParent> parted;
  for (int b = 0; b < bones.size(); ++b) {
    const Bone& bone = bones.bones[size_t(b)];
    if (bone.parent == kNoParent) continue;
    const Bone& parent = bones.bones[size_t(bone.parent)];
    const double seen_mm = surfaces.ApartMm(b, bone.parent);  // of some voxels: they are no farther apart
    if (seen_mm <= kFarMm || !MeetInPreset(bone, parent, region)) continue;
    const double gap_mm = LeastGapMm(bones.labels, bone.label, parent.label, seen_mm);
    if (gap_mm > kFarMm) parted.push_back({b, gap_mm});
  }
  return parted;
}

}  // namespace kvx
