// Distances instead of zeros and ones: thick slices give slopes, not terraces. Smoothing, the tetrahedra's
// cut corners and fewer triangles all take from what is round, small things most, so the level is found for
// which the surface encloses the set's volume.
#include "pipeline/surface/mask_surface.h"

#include <algorithm>
#include <cmath>

#include "core/voxels/components.h"
#include "core/voxels/distance_transform.h"
#include "core/voxels/gaussian_blur.h"
#include "core/voxels/voxel_box.h"
#include "pipeline/surface/level_surface.h"
#include "pipeline/surface/simplified_mesh.h"

namespace kvx {
namespace {

// Voxels around the set: room for the smoothing; beyond, the border's value goes on
constexpr int kMargin = 4;
constexpr double kLeastKept = 0.5;                               // of the set's volume
constexpr double kLeastSmoothing = 0.2;                          // voxels; less changes nothing
constexpr double kVolumeError = 0.005, kSimplifiedError = 0.02;  // of the set's volume
constexpr int kMostCuts = 12, kMostSimplified = 3;

// The set's box with a margin, outside the grid included.
Mask Cropped(const Mask& set) {
  const VoxelBox box = BoxOf(set);
  if (box.empty()) return {};
  const Eigen::Vector3i margin = Eigen::Vector3i::Constant(kMargin);
  Mask out(GridOf({box.low - margin, box.high + margin}, set.grid));
  ForEachVoxel(box, set.grid, [&](const Eigen::Vector3i& p, size_t, size_t v) {
    const Eigen::Vector3i to = p + margin;
    out(to.x(), to.y(), to.z()) = set.values[v] ? 1 : 0;
  });
  return out;
}

// mm to the border, positive inside.
Volume DepthMm(const Mask& set) {
  const Image<double> to_set = SquaredDistanceMm(set), to_rest = SquaredDistanceMm(Complement(set));
  Volume out(set.grid);
  for (size_t v = 0; v < out.values.size(); ++v)
    out.values[v] = float(std::sqrt(to_rest.values[v]) - std::sqrt(to_set.values[v]));
  return out;
}

// Twice the blurred minus the twice blurred: without a second moment, so round things do not shrink.
void Smooth(Volume& volume, double sigma_vox) {
  const Eigen::Vector3d deviation = Eigen::Vector3d::Constant(sigma_vox);
  GaussianBlur(volume, deviation);
  Volume again = volume;
  GaussianBlur(again, deviation);
  for (size_t v = 0; v < volume.values.size(); ++v) volume.values[v] = 2 * volume.values[v] - again.values[v];
}

struct Cut {
  double level_mm = 0;
  TriangleMesh surface;
};

Cut CutAt(double level_mm, const Volume& depth_mm) {
  Volume above = depth_mm;
  for (float& d : above.values) d -= float(level_mm);
  return {level_mm, LevelSurface(above)};
}

// The box's sides must lie outside for the surface to be closed.
double DeepestAtSidesMm(const Volume& depth_mm) {
  float deepest = -INFINITY;
  for (size_t v = 0; v < depth_mm.values.size(); ++v) {
    const Eigen::Array3i p = depth_mm.grid.Ijk(v);
    if ((p == 0).any() || (p + 1 == depth_mm.grid.size.array()).any())
      deepest = std::max(deepest, depth_mm.values[v]);
  }
  return deepest;
}

// By secants, between a level that encloses more and one that encloses less. The first step is what a depth
// in true millimetres would need.
Cut Enclosing(double mm3, const Volume& depth_mm, Cut cut) {
  double least = DeepestAtSidesMm(depth_mm), most = std::ranges::max(depth_mm.values);
  double enclosed = EnclosedVolumeMm3(cut.surface), per_mm = -AreaMm2(cut.surface);
  for (int n = 0; n < kMostCuts && std::abs(enclosed - mm3) > kVolumeError * mm3; ++n) {
    (enclosed > mm3 ? least : most) = cut.level_mm;
    double level_mm = cut.level_mm - (enclosed - mm3) / per_mm;
    if (!(level_mm > least && level_mm < most)) level_mm = (least + most) / 2;
    Cut next = CutAt(level_mm, depth_mm);
    const double now = EnclosedVolumeMm3(next.surface);
    if (now != enclosed) per_mm = (now - enclosed) / (level_mm - cut.level_mm);
    cut = std::move(next), enclosed = now;
  }
  return cut;
}

}  // namespace

TriangleMesh MaskSurface(const Mask& set, const SurfaceOptions& options) {
  const Mask cropped = Cropped(set);
  if (cropped.values.empty()) return {};
  const double mm3 = double(std::ranges::count(cropped.values, uint8_t(1))) * set.grid.spacing_mm.prod();
  const Volume depth_mm = DepthMm(cropped);
  Volume smoothed;
  Cut cut;
  // A set thinner than the smoothing would vanish, or nearly so: it is smoothed less, at last not at all.
  for (double smoothing_vox = options.smoothing_vox;; smoothing_vox /= 2) {
    const bool smooth = smoothing_vox > kLeastSmoothing;
    smoothed = depth_mm;
    if (smooth) Smooth(smoothed, smoothing_vox);
    cut.surface = LevelSurface(smoothed);
    if (!smooth || EnclosedVolumeMm3(cut.surface) >= kLeastKept * mm3) break;
  }
  double wanted_mm3 = mm3;
  for (int n = 1;; ++n) {
    cut = Enclosing(wanted_mm3, smoothed, std::move(cut));
    TriangleMesh simplified =
        SimplifiedMesh(cut.surface, options.largest_error_vox * set.grid.spacing_mm.minCoeff());
    const double share = EnclosedVolumeMm3(simplified) / mm3;
    if (n == kMostSimplified || share <= 0 || std::abs(share - 1) <= kSimplifiedError) return simplified;
    wanted_mm3 /= share;
  }
}

}  // namespace kvx
