// Shells are closed, filled and opened again, each in a box of its own.
#include "pipeline/segmentation/ct/shell_shapes.h"

#include <algorithm>

#include "core/voxels/components.h"
#include "core/voxels/dilated.h"

namespace kvx {
namespace {

constexpr double kGapMm = 2, kGapVoxels = 2;        // half of the widest gap that is closed
constexpr double kDeep = 0.6;                       // of half a gap: marrow lies that far from what it is in
constexpr double kThin = 0.5;                       // of the level: what a thin shell, blurred, still has
constexpr double kNearMm = 3;                       // of a part, its thin shell
constexpr double kBeyondMm = 1, kBeyondVoxels = 2;  // borders are uncertain by that

struct Scales {
  double gap_mm, beyond_mm;
  explicit Scales(const Grid& grid)
      : gap_mm(std::max(kGapMm, kGapVoxels * grid.MeanSpacingMm())),
        beyond_mm(std::max(kBeyondMm, kBeyondVoxels * grid.MeanSpacingMm())) {}
};

Mask Enclosed(const Mask& shell, double gap_mm) { return Eroded(FillHoles(Dilated(shell, gap_mm)), gap_mm); }

ShellShape ShapeOf(const Volume& scan_hu, const LabelMap& parts, int label, const VoxelBox& of_label,
                   double thin_hu) {
  const Scales scales(parts.grid);
  ShellShape shape{GrownByMm(of_label, kNearMm + 2 * scales.gap_mm, parts.grid), {}, {}};
  Mask shell(GridOf(shape.box, parts.grid));
  ForEachVoxel(shape.box, parts.grid, [&](const Eigen::Vector3i&, size_t here, size_t v) {
    shell.values[here] = parts.values[v] == label;
  });
  shape.marrow = Eroded(Enclosed(shell, scales.gap_mm), kDeep * scales.gap_mm);
  const Mask near = Dilated(shell, kNearMm);
  ForEachVoxel(shape.box, parts.grid, [&](const Eigen::Vector3i&, size_t here, size_t v) {
    if (parts.values[v] != 0) shape.marrow.values[here] = 0;
    if (near.values[here] && parts.values[v] == 0 && scan_hu.values[v] > thin_hu) shell.values[here] = 1;
  });
  shape.reach = Dilated(Enclosed(shell, scales.gap_mm), scales.beyond_mm);
  return shape;
}

}  // namespace

std::map<int, ShellShape> ShapesOfShells(const Volume& scan_hu, const LabelMap& parts,
                                         const std::set<int>& labels, double level_hu) {
  std::map<int, ShellShape> shapes;
  for (const auto& [label, box] : BoxesOf(parts)) {
    if (labels.contains(label)) shapes.emplace(label, ShapeOf(scan_hu, parts, label, box, kThin * level_hu));
  }
  return shapes;
}

}  // namespace kvx
