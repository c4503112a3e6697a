// A threshold puts borders of touching bones and of thin shells in wrong places, but what lies deep is sure.
#include "pipeline/segmentation/refined_parts.h"

#include <algorithm>
#include <set>

#include "core/voxels/components.h"
#include "core/voxels/dilated.h"
#include "core/voxels/distance_transform.h"
#include "core/voxels/grid_lines.h"
#include "core/voxels/numbered_voxels.h"
#include "pipeline/segmentation/ct/neck_parts.h"
#include "pipeline/segmentation/ct/shell_shapes.h"
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

// By number, of the parts below the number of background strokes: more are no skeleton's. Depths are from the
// voxels at a part's border.
struct PartSizes {
  std::vector<double> mm3 = std::vector<double>(kBackgroundStroke, 0.0);
  std::vector<float> deepest_mm = std::vector<float>(kBackgroundStroke, 0.0f);

  PartSizes(const LabelMap& parts, const Volume& depth_mm) {
    for (size_t v = 0; v < parts.values.size(); ++v) {
      const uint16_t part = parts.values[v];
      if (part == 0 || part >= kBackgroundStroke) continue;
      mm3[part] += parts.grid.spacing_mm.prod();
      deepest_mm[part] = std::max(deepest_mm[part], depth_mm.values[v]);
    }
  }
  std::set<int> Shells(double voxel_mm) const {
    std::set<int> shells;
    for (int part = 1; part < kBackgroundStroke; ++part)
      if (mm3[part] > 0 && !IsSolid(mm3[part], deepest_mm[part] + 0.5 * voxel_mm)) shells.insert(part);
    return shells;
  }
};

// What stands for strokes: of solid parts the deep half, of shells and meshes, where nothing is deep, all.
LabelMap SureVoxels(const LabelMap& parts, const Volume& depth_mm, const PartSizes& sizes,
                    const std::set<int>& shells) {
  LabelMap sure(parts.grid);
  for (size_t v = 0; v < parts.values.size(); ++v) {
    const uint16_t part = parts.values[v];
    if (part == 0 || part >= kBackgroundStroke) continue;
    if (shells.contains(part) || depth_mm.values[v] >= kDeep * sizes.deepest_mm[part]) sure.values[v] = part;
  }
  return sure;
}

void AddMarrow(const std::map<int, ShellShape>& shapes, LabelMap& sure) {
  for (const auto& [label, shape] : shapes) {
    ForEachVoxel(shape.box, sure.grid, [&](const Eigen::Vector3i&, size_t here, size_t v) {
      if (shape.marrow.values[here]) sure.values[v] = uint16_t(label);
    });
  }
}

void KeepWithinReach(const std::map<int, ShellShape>& shapes, LabelMap& bones) {
  Mask within(bones.grid);
  for (const auto& [label, shape] : shapes) {
    ForEachVoxel(shape.box, bones.grid, [&](const Eigen::Vector3i&, size_t here, size_t v) {
      if (bones.values[v] == label && shape.reach.values[here]) within.values[v] = 1;
    });
  }
  for (size_t v = 0; v < bones.values.size(); ++v)
    if (!within.values[v] && shapes.contains(bones.values[v])) bones.values[v] = 0;
}

LabelMap Others(LabelMap parts) {
  for (uint16_t& part : parts.values) part = part < kBackgroundStroke ? 0 : part;
  return parts;
}

LabelMap NumberedBySize(LabelMap parts) {
  const std::vector<size_t> by_size = LargestFirst(VoxelsByNumber(parts));
  std::vector<uint16_t> number(by_size.size() + 1, 0);
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

LabelMap RefinedParts(const Volume& scan_hu, const LabelMap& parts, double parting_hu,
                      const Progress& progress) {
  const Volume depth_mm = DistanceMapMm(Borders(parts));
  const PartSizes sizes(parts, depth_mm);
  const std::set<int> shells = sizes.Shells(parts.grid.MeanSpacingMm());
  const std::map<int, ShellShape> shapes = ShapesOfShells(scan_hu, parts, shells, parting_hu);
  LabelMap sure = SureVoxels(parts, depth_mm, sizes, shells);
  AddMarrow(shapes, sure);
  const LabelMap others = Others(parts);
  LabelMap refined = GrowBones(scan_hu, sure, true, progress, &others).labels;
  KeepWithinReach(shapes, refined);
  GiveBackMoreThanBorders(scan_hu, parts, refined);
  return NumberedBySize(std::move(refined));
}

}  // namespace kvx
