// Large scans are looked at in blocks: what hangs on small voxels hangs on the level, too.
#include "pipeline/segmentation/ct/threshold_doubt.h"

#include <algorithm>
#include <map>

#include "core/errors.h"
#include "pipeline/scans/coarser.h"
#include "pipeline/segmentation/ct/threshold_bones.h"

namespace kvx {
namespace {

constexpr size_t kMostBlocks = 2'000'000;
constexpr double kALittle = 0.15;  // of the level

LabelMap PartsAt(const Volume& scan_hu, double level_hu, double least_seam = kLeastSeam) {
  try {
    return ThresholdBones(scan_hu, {level_hu, level_hu}, least_seam).labels;
  } catch (const InputError&) {  // nothing is as dense
    return LabelMap(scan_hu.grid);
  }
}

double Kept(const LabelMap& parts, const LabelMap& others) {
  std::map<int, double> voxels, voxels_of_other, best;
  std::map<std::pair<int, int>, double> shared;
  double all = 0, kept = 0;
  for (size_t v = 0; v < parts.values.size(); ++v) {
    const int part = parts.values[v], other = others.values[v];
    if (part != 0) ++voxels[part], ++all;
    if (other != 0) ++voxels_of_other[other];
    if (part != 0 && other != 0) ++shared[{part, other}];
  }
  for (const auto& [pair, both] : shared) {
    double& dice = best[pair.first];
    dice = std::max(dice, 2 * both / (voxels[pair.first] + voxels_of_other[pair.second]));
  }
  for (const auto& [part, dice] : best) kept += dice * voxels[part];
  return all > 0 ? kept / all : 0;
}

}  // namespace

double KeptOtherwise(const Volume& scan_hu, double parting_hu) {
  const VoxelBox all{Eigen::Vector3i::Zero(), scan_hu.grid.size};
  const Volume blocks = Coarser(scan_hu, {all, BlocksFor(all, scan_hu.grid, kMostBlocks).back()});
  const LabelMap parts = PartsAt(blocks, parting_hu);
  const double at_other_levels = std::max(Kept(parts, PartsAt(blocks, (1 - kALittle) * parting_hu)),
                                          Kept(parts, PartsAt(blocks, (1 + kALittle) * parting_hu)));
  return std::min(at_other_levels, Kept(parts, PartsAt(blocks, parting_hu, 0.5 * kLeastSeam)));
}

}  // namespace kvx
