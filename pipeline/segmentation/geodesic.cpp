// Dijkstra's algorithm; equal distances are taken in the order of voxels.
#include "pipeline/segmentation/geodesic.h"

#include <cmath>
#include <limits>
#include <queue>

namespace kvx {
namespace {

struct Step {
  Eigen::Vector3i ijk;
  int64_t offset;
  double length_mm;
};

std::vector<Step> StepsOf(const Grid& grid) {
  std::vector<Step> steps;
  for (int n = 0; n < 27; ++n) {
    const Eigen::Vector3i s(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    const int moved = s.cwiseAbs().sum();
    if (moved == 0 || moved > 2) continue;
    const int64_t offset = (int64_t(s.z()) * grid.size.y() + s.y()) * grid.size.x() + s.x();
    steps.push_back({s, offset, s.cast<double>().cwiseProduct(grid.spacing_mm).norm()});
  }
  return steps;
}

double Paid(double rise, const GeodesicOptions& options) {
  const double paid = options.paid == GeodesicOptions::kChanges ? std::abs(rise)
                      : options.paid == GeodesicOptions::kFalls ? -rise
                                                                : rise;
  return std::max(0.0, paid - options.noise);
}

}  // namespace

Image<float> GeodesicDistance(const Volume& relative, const std::vector<GeodesicSource>& from,
                              const GeodesicOptions& options) {
  const Grid& grid = relative.grid;
  Image<float> distance(grid, std::numeric_limits<float>::infinity());
  using Entry = std::pair<float, uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  for (const GeodesicSource& source : from) {
    if (source.head_start_mm >= distance.values[source.voxel]) continue;
    distance.values[source.voxel] = source.head_start_mm;
    open.push({source.head_start_mm, uint32_t(source.voxel)});
  }
  const std::vector<Step> steps = StepsOf(grid);
  while (!open.empty()) {
    const auto [so_far, at] = open.top();
    open.pop();
    if (so_far > distance.values[at]) continue;
    const Eigen::Vector3i p = grid.Ijk(at);
    for (const Step& step : steps) {
      if (!grid.Contains(Eigen::Vector3i(p + step.ijk))) continue;
      const size_t next = size_t(int64_t(at) + step.offset);
      if (options.within && !options.within->values[next]) continue;
      const double change = Paid(double(relative.values[next]) - relative.values[at], options);
      const float length = so_far + float(step.length_mm + options.mm_per_contrast * change);
      if (length < distance.values[next] && length <= options.most_mm)
        distance.values[next] = length, open.push({length, uint32_t(next)});
    }
  }
  return distance;
}

}  // namespace kvx
