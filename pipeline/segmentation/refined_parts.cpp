// A threshold puts borders of touching bones and of thin shells in wrong places, but what lies deep is sure.
#include "pipeline/segmentation/refined_parts.h"

#include <algorithm>
#include <numeric>

#include "core/voxels/components.h"
#include "core/voxels/dilated.h"
#include "core/voxels/distance_transform.h"
#include "core/voxels/grid_lines.h"
#include "pipeline/segmentation/grow_bones.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"

namespace kvx {
namespace {

constexpr float kDeep = 0.5f;    // of the part's greatest depth
constexpr float kDenseHu = 140;  // denser than soft tissue

// Voxels beside one of another label, or of none.
Mask Borders(const LabelMap& parts) {
  Mask borders(parts.grid);
  ForEachPair(parts.grid, [&](size_t v, size_t next) {
    if (parts.values[v] != parts.values[next]) borders.values[v] = borders.values[next] = 1;
  });
  return borders;
}

// Numbers from that of background strokes on are left to themselves: so many parts are no skeleton's.
LabelMap DeepVoxels(const LabelMap& parts) {
  const Volume depth_mm = DistanceMapMm(Borders(parts));
  std::vector<float> deepest(kBackgroundStroke, 0.0f);
  for (size_t v = 0; v < parts.values.size(); ++v) {
    if (parts.values[v] < kBackgroundStroke)
      deepest[parts.values[v]] = std::max(deepest[parts.values[v]], depth_mm.values[v]);
  }
  LabelMap deep(parts.grid);
  for (size_t v = 0; v < parts.values.size(); ++v) {
    const uint16_t part = parts.values[v];
    if (part != 0 && part < kBackgroundStroke && depth_mm.values[v] >= kDeep * deepest[part])
      deep.values[v] = part;
  }
  return deep;
}

LabelMap Others(LabelMap parts) {
  for (uint16_t& part : parts.values) part = part < kBackgroundStroke ? 0 : part;
  return parts;
}

LabelMap NumberedBySize(LabelMap parts) {
  std::vector<size_t> voxels(size_t(*std::ranges::max_element(parts.values)) + 1, 0);
  for (const uint16_t part : parts.values) ++voxels[part];
  std::vector<uint16_t> by_size(voxels.size() - 1), number(voxels.size(), 0);
  std::iota(by_size.begin(), by_size.end(), uint16_t(1));
  std::ranges::stable_sort(by_size, [&](uint16_t a, uint16_t b) { return voxels[a] > voxels[b]; });
  for (size_t n = 0; n < by_size.size(); ++n) number[by_size[n]] = uint16_t(n + 1);
  for (uint16_t& part : parts.values) part = number[part];
  return parts;
}

// Per piece whether its outermost voxels are dense, as a bone's shell is, in the mean.
std::vector<uint8_t> ShellsAmong(const Volume& scan_hu, const LabelMap& parts, const Components& pieces) {
  const Mask borders = Borders(parts);
  std::vector<double> sum_hu(pieces.voxels.size(), 0.0);
  for (size_t v = 0; v < parts.values.size(); ++v) {
    const int32_t piece = pieces.piece.values[v];
    if (piece >= 0 && borders.values[v]) sum_hu[size_t(piece)] += scan_hu.values[v] - kDenseHu;
  }
  std::vector<uint8_t> shells;
  for (const double hu : sum_hu) shells.push_back(hu > 0);
  return shells;
}

// Borders move by a voxel or two. Bone of which more went lies too far from anything deep, as a thin shaft
// does behind a thick end.
void GiveBackMoreThanBorders(const Volume& scan_hu, const LabelMap& parts, LabelMap& refined) {
  Mask gone(parts.grid);
  for (size_t v = 0; v < gone.values.size(); ++v)
    gone.values[v] = parts.values[v] != 0 && refined.values[v] == 0;
  const Components pieces = LabelComponents(gone);
  std::vector<uint8_t> chosen = PiecesWith(pieces, Eroded(Eroded(gone)));
  const std::vector<uint8_t> shells = ShellsAmong(scan_hu, parts, pieces);
  for (size_t p = 0; p < chosen.size(); ++p) chosen[p] = chosen[p] && shells[p];
  const Mask back = MaskOf(pieces, chosen);
  for (size_t v = 0; v < back.values.size(); ++v)
    if (back.values[v]) refined.values[v] = parts.values[v];
}

}  // namespace

LabelMap RefinedParts(const Volume& scan_hu, const LabelMap& parts, const Progress& progress) {
  const LabelMap others = Others(parts);
  LabelMap refined = GrowBones(scan_hu, DeepVoxels(parts), true, progress, &others).labels;
  GiveBackMoreThanBorders(scan_hu, parts, refined);
  return NumberedBySize(std::move(refined));
}

}  // namespace kvx
