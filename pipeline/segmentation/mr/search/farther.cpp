// Marrow that goes on ends in cortex as the rest of the bone does; fat and muscle behind a thin spot of the
// cortex do not.
#include "pipeline/segmentation/mr/search/farther.h"

#include "core/voxels/components.h"
#include "pipeline/segmentation/mr/shells/outward_rise.h"

namespace kvx {
namespace {

// A piece of more than half the bone is hardly ever an end; fat as large has tendons and muscle beside it.
constexpr double kLargePart = 0.5, kClearerIfLarge = 1.5;

template <class T>
Image<T> OnBox(const Image<T>& image, const VoxelBox& from, const VoxelBox& to, const Grid& scan, T beyond) {
  Image<T> out(GridOf(to, scan), beyond);
  ForEachVoxel({from.low - to.low, from.high - to.low}, out.grid,
               [&](const auto&, size_t part, size_t whole) { out.values[whole] = image.values[part]; });
  return out;
}

FoundBone OnBox(const FoundBone& bone, const VoxelBox& box, const Grid& scan) {
  return {bone.label,
          box,
          OnBox(bone.mask, bone.box, box, scan, uint8_t(0)),
          OnBox(bone.lean, bone.box, box, scan, -1.0f),
          bone.reaches_box,
          OnBox(bone.marrow, bone.box, box, scan, uint8_t(0))};
}

// How much brighter it is outside, over the faces of each piece that are the surface of all.
std::vector<SurfaceRise> RisesOf(const Components& pieces, const Mask& all, const VoxelBox& box,
                                 const Volume& scan, double marrow_level) {
  std::vector<SurfaceRise> rises(pieces.voxels.size());
  ForEachSurfaceFace(scan, box, all, [&](size_t part, double rise) {
    const int32_t piece = pieces.piece.values[part];
    if (piece >= 0) rises[size_t(piece)].Add(rise / marrow_level);
  });
  return rises;
}

}  // namespace

FoundBone WithEnds(const FoundBone& bone, const FoundBone& farther, const Volume& scan, double marrow_level,
                   double clear_rise) {
  const VoxelBox box{bone.box.low.cwiseMin(farther.box.low), bone.box.high.cwiseMax(farther.box.high)};
  FoundBone out = OnBox(bone, box, scan.grid);
  const FoundBone more = OnBox(farther, box, scan.grid);
  Mask added(out.mask.grid), all = out.mask;
  size_t voxels = 0;
  for (size_t v = 0; v < all.values.size(); ++v) {
    added.values[v] = more.mask.values[v] && !out.mask.values[v];
    voxels += out.mask.values[v];
    all.values[v] |= more.mask.values[v];
  }
  const Components pieces = LabelComponents(added);
  const std::vector<SurfaceRise> rises = RisesOf(pieces, all, box, scan, marrow_level);
  std::vector<uint8_t> clear(rises.size());
  for (size_t n = 0; n < clear.size(); ++n) {
    const bool large = double(pieces.voxels[n]) > kLargePart * double(voxels);
    clear[n] = rises[n].Mean() >= (large ? kClearerIfLarge : 1.0) * clear_rise;
  }
  for (size_t v = 0; v < added.values.size(); ++v) {
    if (!added.values[v] || !clear[size_t(pieces.piece.values[v])]) continue;
    out.mask.values[v] = 1;
    out.lean.values[v] = more.lean.values[v];
    out.marrow.values[v] = more.marrow.values[v];
  }
  return out;
}

}  // namespace kvx
