// A thin stroke must not get lost between the voxels of a coarser grid, so marks are carried forward.
#include "pipeline/segmentation/strokes/carried_strokes.h"

#include <map>

#include "core/errors.h"
#include "pipeline/segmentation/strokes/grey_values.h"

namespace kvx {
namespace {

struct Tally {
  size_t marked = 0, inside = 0;
};

// Two maps of as many voxels that do not fill the same place: one of the headers is wrong.
bool SameSizeElsewhere(const Grid& a, const Grid& b) {
  if (a.VoxelCount() != b.VoxelCount()) return false;
  const auto middle = [](const Grid& g) {
    return g.ToMm(PointVox{0.5 * (g.size.cast<double>() - Eigen::Vector3d::Ones())}).lps;
  };
  const auto extent = [](const Grid& g) {
    const Eigen::Vector3d mm = g.size.cast<double>().cwiseProduct(g.spacing_mm);
    return Eigen::Vector3d(g.direction.cwiseAbs() * mm);
  };
  const double voxel_mm = b.spacing_mm.maxCoeff();
  return (middle(a) - middle(b)).norm() > voxel_mm || (extent(a) - extent(b)).norm() > 2 * voxel_mm;
}

void RequireInside(const std::map<int, Tally>& tallies, bool background_suffices) {
  bool bone = false;
  size_t marked = 0, inside = 0;
  for (const auto& [label, tally] : tallies) {
    marked += tally.marked, inside += tally.inside;
    if (label == kBackgroundStroke) continue;
    bone = true;
    if (tally.inside > 0) continue;
    throw InputError("the strokes of bone " + std::to_string(label) +
                     " lie outside the scan; draw them on the template, and keep its place in the world");
  }
  if (!bone && !(background_suffices && marked > 0))
    throw InputError("the strokes mark no bone; bones are 1, 2, ... and 255 is the background");
  if (2 * inside >= marked) return;
  throw InputError(
      "most of the strokes lie outside the scan; draw them on the template, and keep its place in the world");
}

}  // namespace

LabelMap CarriedStrokes(const LabelMap& strokes, const Grid& scan, bool background_suffices) {
  RequireNoGreys(strokes);
  if (!(strokes.grid == scan) && SameSizeElsewhere(strokes.grid, scan)) {
    throw InputError(
        "the strokes have the template's size but another place or spacing; save them with the template's "
        "header");
  }
  LabelMap out(scan);
  std::map<int, Tally> tallies;
  for (size_t v = 0; v < strokes.values.size(); ++v) {
    if (strokes.values[v] == 0) continue;
    Tally& tally = tallies[strokes.values[v]];
    ++tally.marked;
    const PointVox p = scan.ToVox(strokes.grid.ToMm(PointVox{strokes.grid.Ijk(v).cast<double>()}));
    const Eigen::Vector3i nearest = (p.ijk.array() + 0.5).floor().cast<int>().matrix();
    if (!scan.Contains(nearest)) continue;
    ++tally.inside;
    out(nearest.x(), nearest.y(), nearest.z()) = strokes.values[v];
  }
  RequireInside(tallies, background_suffices);
  return out;
}

}  // namespace kvx
