// A voxel is two by two by two samples, their centres a quarter of a voxel from its own.
#include "pipeline/segmentation/mr/shells/smooth_surface.h"

#include <algorithm>

#include "core/voxels/distance_transform.h"
#include "core/voxels/gaussian_blur.h"
#include "core/voxels/sample_clamped.h"
#include "core/voxels/to_corner.h"

namespace kvx {
namespace {

constexpr double kBlurVoxels = 0.6;     // normal deviation
constexpr double kNearVoxels = 0.35;    // samples that stand for the surface
constexpr double kFarVoxels = 1.9;      // from the surface, voxels that it may come to
constexpr double kLeastSlope = 0.4;     // of the distance; less where several ways lead out
constexpr size_t kManySamples = 20000;  // that stand for a surface: the chosen ones do

Grid Halved(const Grid& grid) {
  Grid fine = grid;
  fine.size *= 2;
  fine.spacing_mm /= 2;
  fine.origin = grid.ToMm(PointVox{Eigen::Vector3d::Constant(-0.25)});
  return fine;
}

// A quarter of the samples in any plane along the axes.
bool IsOneInFour(const Eigen::Vector3i& p) { return (p.x() + 2 * p.y() + 3 * p.z()) % 4 == 0; }

Volume SignedDistanceMm(const Mask& mask, const Grid& fine) {
  Mask inside(fine), outside(fine);
  for (size_t v = 0; v < inside.values.size(); ++v) {
    const Eigen::Vector3i p = fine.Ijk(v) / 2;
    inside.values[v] = mask(p.x(), p.y(), p.z()), outside.values[v] = !inside.values[v];
  }
  const Volume out = DistanceMapMm(inside), in = DistanceMapMm(outside);
  const float half = float(0.5 * fine.MeanSpacingMm());
  Volume distance(fine);
  for (size_t v = 0; v < distance.values.size(); ++v)
    distance.values[v] = inside.values[v] ? half - in.values[v] : out.values[v] - half;
  return distance;
}

Eigen::Vector3d SlopeAt(const Volume& image, const Eigen::Vector3i& p) {
  Eigen::Vector3d slope;
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3i a = p, b = p;
    a[axis] = std::max(p[axis] - 1, 0), b[axis] = std::min(p[axis] + 1, image.grid.size[axis] - 1);
    slope[axis] = (image(b.x(), b.y(), b.z()) - image(a.x(), a.y(), a.z())) /
                  (std::max(b[axis] - a[axis], 1) * image.grid.spacing_mm[axis]);
  }
  return slope;
}

}  // namespace

SmoothSurface::SmoothSurface(const Mask& mask) : voxels_(mask.grid), fine_(Halved(mask.grid)) {
  if (std::ranges::find(mask.values, uint8_t(1)) == mask.values.end()) return;
  const double voxel_mm = voxels_.MeanSpacingMm();
  beyond_mm_ = SignedDistanceMm(mask, fine_);
  GaussianBlur(beyond_mm_, kBlurVoxels * voxel_mm / fine_.spacing_mm.array());
  point_at_ = Image<int32_t>(fine_, -1);
  const auto is_near = [&](float beyond_mm) { return std::abs(beyond_mm) < kNearVoxels * voxel_mm; };
  const bool many = size_t(std::ranges::count_if(beyond_mm_.values, is_near)) > kManySamples;
  for (size_t v = 0; v < point_at_.values.size(); ++v) {
    const bool chosen = IsOneInFour(fine_.Ijk(v));
    if (!is_near(beyond_mm_.values[v]) || (many && !chosen)) continue;
    if (const auto point = PointOf(fine_.Ijk(v), beyond_mm_.values[v])) {
      point_at_.values[v] = int32_t(points_.size());
      points_.push_back(*point);
      points_.back().depth_mm = DepthMm(*point);
      points_.back().chosen = chosen;
    }
  }
}

// Inwards until it gets no deeper.
double SmoothSurface::DepthMm(const SurfacePoint& point) const {
  constexpr double kMostVoxels = 6;
  const double step_mm = 0.5 * fine_.MeanSpacingMm(), most_mm = kMostVoxels * voxels_.MeanSpacingMm();
  double depth_mm = 0, deepest = 0;
  for (; depth_mm < most_mm; depth_mm += step_mm) {
    const Eigen::Vector3d mm = point.at_mm - (depth_mm + step_mm) * point.outwards;
    const PointVox at{(mm.cwiseQuotient(fine_.spacing_mm).array() + 0.5).matrix()};
    const double beyond = SampleClamped(beyond_mm_, at);
    if (beyond >= deepest) break;
    deepest = beyond;
  }
  return depth_mm;
}

std::optional<SurfacePoint> SmoothSurface::PointOf(const Eigen::Vector3i& fine, double beyond_mm) const {
  const Eigen::Vector3d slope = SlopeAt(beyond_mm_, fine);
  const double steep = slope.norm();
  if (steep < kLeastSlope) return std::nullopt;
  const Eigen::Vector3d outwards = slope / steep;
  const Eigen::Vector3d at_mm = (fine.cast<double>().array() - 0.5).matrix().cwiseProduct(fine_.spacing_mm);
  return SurfacePoint{at_mm - beyond_mm / steep * outwards, outwards, beyond_mm, 0};
}

std::optional<SurfacePoint> SmoothSurface::Under(size_t voxel) const {
  if (points_.empty()) return std::nullopt;
  const Eigen::Vector3i first = 2 * voxels_.Ijk(voxel);
  SurfacePoint mean{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0};
  int count = 0;
  for (int n = 0; n < 8; ++n) {
    const Eigen::Vector3i p = first + ToCorner(n);
    const double beyond_mm = beyond_mm_(p.x(), p.y(), p.z());
    mean.beyond_mm += beyond_mm / 8;
    if (const auto point = PointOf(p, beyond_mm)) mean.at_mm += point->at_mm, ++count;
  }
  if (count == 0 || std::abs(mean.beyond_mm) > kFarVoxels * voxels_.MeanSpacingMm()) return std::nullopt;
  mean.at_mm /= count;
  return mean;
}

}  // namespace kvx
