// Strokes may lie on any grid: every marked voxel is carried to the scan's voxel at its place.
#include "pipeline/segmentation/segment_bones.h"

#include <algorithm>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/segmentation/grow_bones.h"
#include "pipeline/segmentation/threshold_bones.h"

namespace kvx {
namespace {

constexpr float kCtAirHu = -500;

// A thin stroke must not get lost between the voxels of a coarser grid, so marks are carried forward.
LabelMap OnGrid(const LabelMap& strokes, const Grid& grid) {
  if (strokes.grid == grid) return strokes;
  LabelMap out(grid);
  for (size_t v = 0; v < strokes.values.size(); ++v) {
    if (strokes.values[v] == 0) continue;
    const PointVox p = grid.ToVox(strokes.grid.ToMm(PointVox{strokes.grid.Ijk(v).cast<double>()}));
    const Eigen::Vector3i nearest = (p.ijk.array() + 0.5).floor().cast<int>().matrix();
    if (grid.Contains(nearest)) out(nearest.x(), nearest.y(), nearest.z()) = strokes.values[v];
  }
  return out;
}

}  // namespace

bool LooksLikeCt(const Scan& scan) {
  if (!scan.modality.empty()) return scan.modality == "CT";
  return *std::min_element(scan.volume.values.begin(), scan.volume.values.end()) < kCtAirHu;
}

SegmentedBones SegmentBones::Run(const Inputs& inputs, const Options& options, StageContext& context) {
  const Scan& scan = *inputs.scan;
  const bool ct = LooksLikeCt(scan);
  if (!inputs.strokes_path.empty()) {
    const LabelMap strokes = OnGrid(ReadLabels(inputs.strokes_path), scan.volume.grid);
    GrownBones grown = GrowBones(scan.volume, strokes, ct, context.progress);
    return {std::move(grown.labels), std::move(grown.warnings)};
  }
  if (!ct)
    throw InputError(
        "a threshold tells bone from soft tissue in CT only; draw strokes (bones.seeds) in an MR scan");
  const double level_hu = options.level_hu.value_or(FindBoneLevel(scan.volume));
  context.progress.Report(kName, 0.2);
  return {ThresholdBones(scan.volume, level_hu), {}};
}

}  // namespace kvx
