// Profiles along the gradient of the distance from the marrow give the usual thickness; a minimum cut gives
// the border.
#include "pipeline/segmentation/mr/search/cortex.h"

#include <cmath>

#include "core/numbers/quantile.h"
#include "core/voxels/distance_transform.h"

namespace kvx {
namespace {

constexpr double kMostCortexMm = 8;
constexpr double kLeastRise = 0.12;  // of relative intensity, from the cortex to what lies beyond
constexpr double kNotDark = 0.75;    // relative intensity that is no cortex
constexpr double kLookNats = 1.5, kPlaceNats = 2.0, kLinkNats = 3.0;
constexpr double kFarVoxels = 1.5;  // beyond the usual thickness: rather a tendon
constexpr double kFarNats = 2.0;    // of every voxel more

Volume DistanceMm(const Mask& inner) {
  const Image<double> squared = SquaredDistanceMm(inner);
  Volume distance(inner.grid);
  for (size_t v = 0; v < distance.values.size(); ++v)
    distance.values[v] = float(std::sqrt(squared.values[v]));
  return distance;
}

// The direction away from the marrow at a voxel, unit millimetres along the grid's axes; zero at the border
// of the box and where several ways lead out.
Eigen::Vector3d Outwards(const Volume& distance, size_t v) {
  const Eigen::Vector3i p = distance.grid.Ijk(v);
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    if (p[axis] == 0 || p[axis] + 1 == distance.grid.size[axis]) return Eigen::Vector3d::Zero();
    out[axis] =
        (distance.values[v + stride] - distance.values[v - stride]) / (2 * distance.grid.spacing_mm[axis]);
    stride *= size_t(distance.grid.size[axis]);
  }
  return out.norm() < 0.3 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(out.normalized());
}

// Where a profile is half way up again after its first minimum, in samples; negative when it does not rise.
double RiseAt(const std::vector<double>& profile) {
  size_t low = 0;
  while (low + 1 < profile.size() && profile[low + 1] < profile[low]) ++low;
  size_t high = low;
  double steepest = 0;  // a second rise, from muscle to fat say, is not the cortex' own
  while (high + 1 < profile.size() && profile[high + 1] > profile[high]) {
    const double rise = profile[high + 1] - profile[high];
    if (profile[high] - profile[low] >= kLeastRise && rise < 0.5 * steepest) break;
    steepest = std::max(steepest, rise);
    ++high;
  }
  if (profile[high] - profile[low] < kLeastRise || profile[low] > kNotDark) return -1;
  const double level = 0.5 * (profile[low] + profile[high]);
  size_t at = low;
  while (profile[at] < level) ++at;
  return at == 0 ? 0 : double(at) - (profile[at] - level) / (profile[at] - profile[at - 1]);
}

// In nats, of cortex as far beyond (negative: within) its usual thickness.
double CostAt(double beyond_usual_voxels) {
  return std::clamp(2 * beyond_usual_voxels, -kPlaceNats, kPlaceNats) +
         kFarNats * std::max(0.0, beyond_usual_voxels - kFarVoxels);
}

// The median over the marrow's surface of how thick the dark layer is.
double UsualThicknessMm(const Volume& relative, const Volume& distance) {
  const Grid& grid = relative.grid;
  const double step_mm = 0.5 * grid.spacing_mm.minCoeff(), voxel_mm = grid.MeanSpacingMm();
  std::vector<double> thickness, profile;
  for (size_t v = 0; v < distance.values.size(); ++v) {
    if (distance.values[v] <= 0 || distance.values[v] > 1.01 * grid.spacing_mm.maxCoeff()) continue;
    const Eigen::Vector3d out = Outwards(distance, v).cwiseQuotient(grid.spacing_mm);
    if (out.isZero()) continue;
    const Eigen::Vector3d start = grid.Ijk(v).cast<double>() - (distance.values[v] - 0.5 * voxel_mm) * out;
    profile.clear();
    for (double t = 0; t < kMostCortexMm; t += step_mm) {
      profile.push_back(SampleTrilinear(relative, PointVox{start + t * out}));
    }
    if (const double rise = RiseAt(profile); rise >= 0) thickness.push_back(rise * step_mm);
  }
  if (thickness.empty()) return voxel_mm;
  return TakeMedian(thickness);
}

}  // namespace

Mask WithCortex(const StrokeBone& bone, const TissueCounts& tissues) {
  const Volume& relative = bone.relative();
  Mask inner = bone.found();
  for (size_t v = 0; v < inner.values.size(); ++v) inner.values[v] |= bone.own_strokes().values[v];
  const Volume distance = DistanceMm(inner);
  const double voxel_mm = relative.grid.MeanSpacingMm(), usual_mm = UsualThicknessMm(relative, distance);
  const double cortex = tissues.CortexLevel();
  CutLayer layer{Image<float>(relative.grid),
                 Image<Side>(relative.grid, Side::kOutside),
                 {.strength = kLinkNats,
                  .contrast = std::max(bone.EdgeOf(kLeastRise), 2 * bone.noise()),
                  .falls_outwards = -1}};
  for (size_t v = 0; v < inner.values.size(); ++v) {
    if (inner.values[v]) layer.sides.values[v] = Side::kInside;
    const double depth_mm = distance.values[v] - 0.5 * voxel_mm;  // from the marrow's surface
    if (inner.values[v] || bone.IsElsewhere(v) || depth_mm > usual_mm + 3 * voxel_mm) continue;
    layer.sides.values[v] = Side::kFree;
    layer.inside_cost.values[v] =
        float(std::clamp((relative.values[v] - (cortex + 0.2)) / 0.1, -kLookNats, kLookNats) +
              CostAt((depth_mm - usual_mm) / voxel_mm));
  }
  return MinimumCut(std::move(layer), relative);
}

}  // namespace kvx
