// Components by 6-neighbours; holes as skinning's FillHoles, which closes those that the scan's border cuts,
// too. Strokes have the last word over both holes and calm.
#include "pipeline/segmentation/finish_bone.h"

#include <algorithm>
#include <array>
#include <functional>

#include "core/voxels/components.h"
#include "core/voxels/dilated.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"

namespace kvx {
namespace {

Mask TouchedPieces(const Mask& mask, const Mask& strokes) {
  const Components pieces = LabelComponents(mask);
  return MaskOf(pieces, PiecesWith(pieces, strokes));
}

Mask Without(Mask mask, const Mask& others) {
  for (size_t v = 0; v < mask.values.size(); ++v) mask.values[v] &= uint8_t(!others.values[v]);
  return mask;
}

size_t Count(const Mask& mask) {
  return size_t(std::count(mask.values.begin(), mask.values.end(), uint8_t(1)));
}

// A hole in which the background was marked is meant.
Mask WithoutHoles(const Mask& mask, const Mask& background) {
  const Mask filled = FillHoles(mask);
  if (Count(background) == 0) return filled;
  const Components holes = LabelComponents(Without(filled, mask));
  return Without(filled, MaskOf(holes, PiecesWith(holes, background)));
}

// Whether several stroke voxels lie away from all of the bone that is thicker than a line.
bool HasBareStrokes(const Mask& bone, const Mask& strokes) {
  constexpr size_t kSeveral = 3;
  const Mask thick = Dilated(Eroded(bone));
  if (2 * Count(thick) < Count(bone)) return false;  // thin all over
  const Mask near = Dilated(thick);
  size_t bare = 0;
  for (size_t v = 0; v < near.values.size(); ++v) bare += strokes.values[v] && !near.values[v];
  return bare >= kSeveral;
}

void BlurAxis(int axis, Image<float>& image) {
  const Image<float> before = image;
  const std::array<size_t, 3> strides{1, size_t(image.grid.size.x()),
                                      size_t(image.grid.size.x()) * image.grid.size.y()};
  const size_t stride = strides[axis];
  for (size_t v = 0; v < image.values.size(); ++v) {
    const int at = image.grid.Ijk(v)[axis];
    const float here = before.values[v];
    const float down = at > 0 ? before.values[v - stride] : here;
    const float up = at + 1 < image.grid.size[axis] ? before.values[v + stride] : here;
    image.values[v] = 0.25f * down + 0.5f * here + 0.25f * up;
  }
}

}  // namespace

Mask Smoothed(const Mask& mask, const Mask& keep) {
  Image<float> blurred(mask.grid);
  for (size_t v = 0; v < mask.values.size(); ++v) blurred.values[v] = mask.values[v];
  for (int axis = 0; axis < 3; ++axis) {
    if (mask.grid.size[axis] > 1) BlurAxis(axis, blurred);
  }
  std::vector<float> ranked;
  for (const float b : blurred.values) {
    if (b > 0) ranked.push_back(b);
  }
  Mask out = keep;
  if (ranked.empty()) return out;
  const auto level = ranked.begin() + std::min(Count(mask), ranked.size() - 1);
  std::nth_element(ranked.begin(), level, ranked.end(), std::greater<>());
  for (size_t v = 0; v < out.values.size(); ++v) out.values[v] |= blurred.values[v] > *level;
  return out;
}

BoneFinish FinishBone(const LabelMap& labels, const LabelMap& strokes, int label, const VoxelBox& box,
                      bool calm) {
  const Grid grid = GridOf(box, labels.grid);
  Mask mask(grid), marks(grid), background(grid), others(grid);
  ForEachVoxel(box, labels.grid, [&](const auto&, size_t part, size_t whole) {
    const int stroke = strokes.values[whole];
    marks.values[part] = stroke == label;
    background.values[part] = stroke == kBackgroundStroke;
    others.values[part] = stroke != 0 && stroke != label;
    mask.values[part] = marks.values[part] || (labels.values[whole] == label && stroke == 0);
  });
  BoneFinish out{WithoutHoles(TouchedPieces(mask, marks), background)};
  if (calm) out.mask = Smoothed(out.mask, marks);
  out.mask = TouchedPieces(Without(out.mask, others), marks);
  out.marked = double(Count(marks)) / double(std::max<size_t>(Count(out.mask), 1));
  out.bare = calm && out.marked <= kMostlyMarked && HasBareStrokes(out.mask, marks);
  return out;
}

}  // namespace kvx
