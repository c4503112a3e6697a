// Otsu's threshold finds bone, and the mean intensity on its surface, weighted by the gradient (Kittler et
// al. 1985), its level: about half way up the slope.
#include "pipeline/segmentation/ct/threshold_bones.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "core/voxels/components.h"
#include "core/voxels/neighbours.h"
#include "core/voxels/numbered_voxels.h"
#include "pipeline/scans/air_level.h"
#include "pipeline/segmentation/ct/joined_parts.h"
#include "pipeline/segmentation/ct/neck_parts.h"

namespace kvx {
namespace {

constexpr float kLeastHu = -200, kMostHu = 1500;  // air and metal say nothing about bone
constexpr float kFatHu = -50;                     // much fat beside little bone would be a class of its own
constexpr double kClearlyDenser = 1.4;            // than a level, another

Mask Above(const Volume& scan, double level_hu) {
  Mask mask(scan.grid);
  for (size_t v = 0; v < mask.values.size(); ++v) mask.values[v] = scan.values[v] > level_hu;
  return mask;
}

// The voxel and those up to two steps away along the axes, in HU; metal counts as dense bone.
struct Cross {
  float here, least, most;
  double slope;  // change per mm
};

Cross CrossAt(const Volume& scan, size_t v) {
  const auto hu = [&](size_t at) { return std::min(scan.values[at], kMostHu); };
  const Eigen::Vector3i p = scan.grid.Ijk(v);
  Cross cross{hu(v), hu(v), hu(v), 0};
  size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = scan.grid.size[axis] - 1;
    for (const int step : {-2, -1, 1, 2}) {
      if (p[axis] + step < 0 || p[axis] + step > last) continue;
      const float there = hu(v + size_t(step) * stride);
      cross.least = std::min(cross.least, there), cross.most = std::max(cross.most, there);
    }
    if (p[axis] > 0 && p[axis] < last) {
      const double change = hu(v + stride) - hu(v - stride);
      cross.slope += std::pow(change / (2 * scan.grid.spacing_mm[axis]), 2);
    }
    stride *= size_t(scan.grid.size[axis]);
  }
  cross.slope = std::sqrt(cross.slope);
  return cross;
}

// Of the voxels near the surface of what is denser than `rough_hu`, away from air.
double LevelOfSurface(const Volume& scan, double rough_hu) {
  double sum = 0, slopes = 0;
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Cross cross = CrossAt(scan, v);
    if (cross.least <= kLeastHu || cross.least > rough_hu || cross.most <= rough_hu) continue;
    sum += cross.slope * cross.here, slopes += cross.slope;
  }
  return slopes > 0 ? sum / slopes : rough_hu;
}

struct DenseParts {
  Image<int32_t> number;  // 0 outside
  DenseInAir in_air;
};

// A cast encloses its limb: it goes before holes are filled.
DenseParts PartsAt(const Volume& scan, double level_hu, double least_seam) {
  Mask dense = Above(scan, level_hu);
  const DenseInAir in_air = DropPiecesInAir(scan, dense);
  return {JoinedParts(scan, PartAtNecks(FillHoles(dense)), least_seam), in_air};
}

// Without parts that are too small for a bone.
void DropSmall(Image<int32_t>& part) {
  const std::vector<size_t> voxels = VoxelsByNumber(part);
  const double least = kLeastBoneMm3 / part.grid.spacing_mm.prod();
  for (int32_t& p : part.values)
    if (double(voxels[size_t(p)]) < least) p = 0;
}

// `parts` of a lower level, those that hold parts of a higher one divided among these: each voxel goes to the
// one that is fewest steps away.
Image<int32_t> AsPartedBy(Image<int32_t> dense, const Image<int32_t>& parts) {
  DropSmall(dense);
  std::vector<uint8_t> holds(size_t(*std::ranges::max_element(parts.values)) + 1, 0);
  std::vector<size_t> front;
  for (size_t v = 0; v < dense.values.size(); ++v)
    if (dense.values[v] != 0) holds[size_t(parts.values[v])] = 1, front.push_back(v);
  for (size_t next = 0; next < front.size(); ++next) {
    ForEachNeighbour(parts.grid, front[next], [&](size_t beside) {
      const int32_t part = parts.values[beside];
      if (part == 0 || !holds[size_t(part)] || dense.values[beside] != 0) return;
      dense.values[beside] = dense.values[front[next]];
      front.push_back(beside);
    });
  }
  const int32_t others = *std::ranges::max_element(dense.values);
  for (size_t v = 0; v < dense.values.size(); ++v)
    if (parts.values[v] != 0 && dense.values[v] == 0) dense.values[v] = others + parts.values[v];
  return dense;
}

}  // namespace

double FindBoneLevel(const Volume& scan) {
  std::vector<float> dense;
  for (const float v : scan.values) {
    if (v > kFatHu) dense.push_back(std::min(v, kMostHu));
  }
  if (dense.empty())
    throw InputError("the scan shows nothing denser than fat; is it a CT in Hounsfield units?");
  return LevelOfSurface(scan, OtsuThreshold(dense));
}

BoneLevels LevelsOf(const Volume& scan, std::optional<double> given_hu) {
  const double found_hu = FindBoneLevel(scan), bone_hu = given_hu.value_or(found_hu);
  return {bone_hu, found_hu > kClearlyDenser * bone_hu ? found_hu : bone_hu};
}

DenseBones ThresholdBones(const Volume& scan, const BoneLevels& levels, double least_seam) {
  auto [part, in_air] = PartsAt(scan, levels.bone_hu, least_seam);
  if (levels.parting_hu > levels.bone_hu)
    part = AsPartedBy(PartsAt(scan, levels.parting_hu, least_seam).number, part);
  const std::vector<size_t> voxels = VoxelsByNumber(part);
  std::vector<uint16_t> label_of(voxels.size(), 0);
  uint16_t label = 0;
  for (const size_t p : LargestFirst(voxels)) {
    if (double(voxels[p]) * scan.grid.spacing_mm.prod() >= kLeastBoneMm3 && label < 65000)
      label_of[p] = ++label;
  }
  if (label == 0) throw InputError("nothing is as dense as the threshold; give a lower bones.threshold");
  LabelMap labels(scan.grid);
  for (size_t v = 0; v < labels.values.size(); ++v) labels.values[v] = label_of[part.values[v]];
  return {std::move(labels), in_air};
}

}  // namespace kvx
