// An opening that is undone where bones are: the limb's core is what stays connected to bones a little below
// the skin, and the limb what lies within reach of it.
#include "pipeline/skinning/without_surroundings.h"

#include <algorithm>

#include "core/bone_of_label.h"
#include "core/host/parallel.h"
#include "core/voxels/components.h"
#include "core/voxels/distance_transform.h"

namespace kvx {
namespace {

constexpr double kSheetMm = 2.5;        // half of what a plate or a shell is thick, and a voxel at least
constexpr double kThickMm = 8.0;        // a piece whose middle lies deeper is no plate
constexpr double kCornersReach = 1.75;  // of the depth taken off: as far as corners lie from the core
constexpr double kOtherLimb = 0.05;     // of the limb's voxels: a larger piece without bones is another one

Mask BonesOf(const BoneSet& bones) {
  const std::vector<int> bone_of_label = BoneOfLabel(bones.bones);
  Mask out(bones.labels.grid);
  ParallelEach(out.values.size(),
               [&](size_t v) { out.values[v] = bone_of_label[bones.labels.values[v]] != kNoBone; });
  return out;
}

Mask Either(Mask a, const Mask& b) {
  ParallelEach(a.values.size(), [&](size_t v) { a.values[v] |= b.values[v]; });
  return a;
}

Mask DeeperThan(const Volume& depth_mm, double mm) {
  Mask out(depth_mm.grid);
  ParallelEach(out.values.size(), [&](size_t v) { out.values[v] = depth_mm.values[v] > mm; });
  return out;
}

}  // namespace

Mask WithoutSurroundings(const Mask& body, const BoneSet& bones) {
  const Mask bone = BonesOf(bones);
  if (std::ranges::find(bone.values, 1) == bone.values.end()) return body;
  const double voxel_mm = body.grid.spacing_mm.maxCoeff(), sheet_mm = std::max(kSheetMm, 1.01 * voxel_mm);
  const Volume depth_mm = DistanceMapMm(Complement(body));
  const Components cores = LabelComponents(Either(DeeperThan(depth_mm, sheet_mm), bone));
  const std::vector<uint8_t> with_bone = PiecesWith(cores, bone),
                             thick = PiecesWith(cores, DeeperThan(depth_mm, kThickMm));
  std::vector<uint8_t> limb(with_bone), other(with_bone.size());
  for (size_t p = 0; p < limb.size(); ++p) limb[p] |= thick[p], other[p] = !limb[p];
  const Mask core = MaskOf(cores, limb);
  const Volume to_core_mm = DistanceMapMm(core), to_other_mm = DistanceMapMm(MaskOf(cores, other));
  const double reach_mm = kCornersReach * sheet_mm + voxel_mm;
  Mask near(body.grid);
  ParallelEach(near.values.size(), [&](size_t v) {
    near.values[v] =
        body.values[v] && to_core_mm.values[v] <= std::min<float>(float(reach_mm), to_other_mm.values[v]);
  });
  const Components pieces = LabelComponents(Either(near, core));
  const Mask kept = MaskOf(pieces, PiecesWith(pieces, core));
  Mask out(body.grid);
  ParallelEach(out.values.size(), [&](size_t v) { out.values[v] = kept.values[v] && body.values[v]; });
  return out;
}

Mask WithoutOtherLimbs(const Mask& body, const BoneSet& bones) {
  const Components pieces = LabelComponents(body);
  std::vector<uint8_t> kept = PiecesWith(pieces, BonesOf(bones));
  size_t limb = 0;
  for (size_t p = 0; p < kept.size(); ++p) limb += kept[p] ? pieces.voxels[p] : 0;
  if (limb == 0) return body;
  for (size_t p = 0; p < kept.size(); ++p) kept[p] |= double(pieces.voxels[p]) <= kOtherLimb * double(limb);
  return MaskOf(pieces, kept);
}

}  // namespace kvx
