// Distances instead of zeros and ones: thick slices give slopes, not terraces.
#include "pipeline/surface/mask_surface.h"

#include <algorithm>
#include <cmath>

#include "core/components.h"
#include "core/distance_transform.h"
#include "core/gaussian_blur.h"
#include "core/voxel_box.h"
#include "pipeline/surface/level_surface.h"
#include "pipeline/surface/simplified_mesh.h"

namespace kvx {
namespace {

// Voxels around the set: room for the smoothing; beyond, the border's value goes on
constexpr int kMargin = 4;
constexpr double kLeastKept = 0.5;       // of the set's volume
constexpr double kLeastSmoothing = 0.2;  // voxels; less changes nothing

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

}  // namespace

// A set thinner than the smoothing would vanish, or nearly so: it is smoothed less, at last not at all.
TriangleMesh MaskSurface(const Mask& set, const SurfaceOptions& options) {
  const Mask cropped = Cropped(set);
  if (cropped.values.empty()) return {};
  const double least_mm3 =
      kLeastKept * double(std::ranges::count(cropped.values, uint8_t(1))) * set.grid.spacing_mm.prod();
  const Volume depth = DepthMm(cropped);
  TriangleMesh surface;
  for (double smoothing_vox = options.smoothing_vox;; smoothing_vox /= 2) {
    const bool smooth = smoothing_vox > kLeastSmoothing;
    Volume smoothed = depth;
    if (smooth) Smooth(smoothed, smoothing_vox);
    surface = LevelSurface(smoothed);
    if (!smooth || EnclosedVolumeMm3(surface) >= least_mm3) break;
  }
  return SimplifiedMesh(surface, options.largest_error_vox * set.grid.spacing_mm.minCoeff());
}

}  // namespace kvx
