// The strokes are taken for a uniform ellipsoid that is parted among a dozen lines.
#include "pipeline/segmentation/strokes/stroke_remoteness.h"

#include <cmath>

#include "core/host/parallel.h"
#include "core/voxels/distance_transform.h"
#include "pipeline/segmentation/strokes/stroke_hull.h"

namespace kvx {
namespace {

struct Spread {
  Eigen::Vector3d mean_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d mm2 = Eigen::Matrix3d::Zero();
};

PointMm PlaceOf(const Grid& grid, size_t v) { return grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}); }

std::vector<PointMm> PlacesOf(const Mask& strokes) {
  std::vector<PointMm> places;
  for (size_t v = 0; v < strokes.values.size(); ++v) {
    if (strokes.values[v]) places.push_back(PlaceOf(strokes.grid, v));
  }
  return places;
}

// A line of voxels has the thickness of a voxel.
Spread SpreadOf(const std::vector<PointMm>& places, double voxel_mm) {
  Spread spread;
  for (const PointMm& place : places) {
    spread.mean_mm += place.lps / double(places.size());
    spread.mm2 += place.lps * place.lps.transpose() / double(places.size());
  }
  spread.mm2 -= spread.mean_mm * spread.mean_mm.transpose();
  spread.mm2 += Eigen::Matrix3d::Identity() * std::pow(voxel_mm / 2, 2);
  return spread;
}

}  // namespace

Image<float> RemotenessFromLines(const Mask& strokes) {
  constexpr double kLines = 12, kUsualEnd = 2.5;
  const Grid& grid = strokes.grid;
  const Spread spread = SpreadOf(PlacesOf(strokes), grid.MeanSpacingMm());
  const Eigen::Matrix3d inverse = spread.mm2.inverse();
  const double ellipsoid_mm3 = 4.0 / 3 * M_PI * std::pow(5, 1.5) * std::sqrt(spread.mm2.determinant());
  const double spacing_mm = std::cbrt(ellipsoid_mm3 / kLines);
  const Image<double> squared_mm = SquaredDistanceMm(strokes);
  Image<float> remoteness(grid);
  for (size_t v = 0; v < remoteness.values.size(); ++v) {
    const Eigen::Vector3d d = PlaceOf(grid, v).lps - spread.mean_mm;
    const double in_spacings = std::sqrt(squared_mm.values[v]) / spacing_mm;
    remoteness.values[v] = float((in_spacings + 0.5 * std::sqrt(d.dot(inverse * d))) / kUsualEnd);
  }
  return remoteness;
}

Image<float> RemotenessFromHull(const Mask& strokes) {
  constexpr double kUsualEnd = 0.8;
  const Grid& grid = strokes.grid;
  const std::vector<PointMm> places = PlacesOf(strokes);
  const StrokeHull hull(places);
  const double spread_mm = std::pow(SpreadOf(places, grid.MeanSpacingMm()).mm2.determinant(), 1.0 / 6);
  Image<float> remoteness(grid);
  ParallelFor(remoteness.values.size() / size_t(grid.size.x()), [&](size_t line) {
    for (size_t v = line * size_t(grid.size.x()); v < (line + 1) * size_t(grid.size.x()); ++v)
      remoteness.values[v] = float(hull.BeyondMm(PlaceOf(grid, v)) / (kUsualEnd * spread_mm));
  });
  return remoteness;
}

}  // namespace kvx
