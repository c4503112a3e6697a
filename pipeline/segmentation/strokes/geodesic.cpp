// Dijkstra's algorithm with buckets as wide as the shortest step (Dial 1969): nothing in a bucket is reached
// from the others in it.
#include "pipeline/segmentation/strokes/geodesic.h"

#include <cmath>
#include <limits>

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

// Voxels to go on from, by their distance. Emptied in order.
class Buckets {
 public:
  struct Entry {
    float distance_mm;
    uint32_t voxel;
  };

  explicit Buckets(double width_mm) : per_mm_(1 / width_mm) {}
  void Add(float distance_mm, size_t voxel) {
    const size_t bucket = size_t(distance_mm * per_mm_);
    if (bucket >= buckets_.size()) buckets_.resize(bucket + 1);
    buckets_[bucket].push_back({distance_mm, uint32_t(voxel)});
  }
  // False when all are empty.
  bool Take(Entry& entry) {
    while (first_ < buckets_.size() && taken_ == buckets_[first_].size()) {
      buckets_[first_++] = {};
      taken_ = 0;
    }
    if (first_ >= buckets_.size()) return false;
    entry = buckets_[first_][taken_++];
    return true;
  }

 private:
  double per_mm_;
  std::vector<std::vector<Entry>> buckets_;
  size_t first_ = 0, taken_ = 0;
};

bool OnBorder(const Eigen::Vector3i& p, const Grid& grid) {
  return (p.array() == 0).any() || (p.array() + 1 == grid.size.array()).any();
}

}  // namespace

Image<float> GeodesicDistance(const Volume& relative, const std::vector<GeodesicSource>& from,
                              const GeodesicOptions& options) {
  const Grid& grid = relative.grid;
  Image<float> distance(grid, std::numeric_limits<float>::infinity());
  Buckets open(grid.spacing_mm.minCoeff());
  for (const GeodesicSource& source : from) {
    if (source.head_start_mm >= distance.values[source.voxel]) continue;
    distance.values[source.voxel] = source.head_start_mm;
    open.Add(source.head_start_mm, source.voxel);
  }
  const std::vector<Step> steps = StepsOf(grid);
  for (Buckets::Entry entry; open.Take(entry);) {
    const auto [so_far, at] = entry;
    if (so_far > distance.values[at]) continue;
    const Eigen::Vector3i p = grid.Ijk(at);
    const bool on_border = OnBorder(p, grid);
    for (const Step& step : steps) {
      if (on_border && !grid.Contains(Eigen::Vector3i(p + step.ijk))) continue;
      const size_t next = size_t(int64_t(at) + step.offset);
      if (so_far + float(step.length_mm) >= distance.values[next]) continue;
      if (options.within && !options.within->values[next]) continue;
      const double change = Paid(double(relative.values[next]) - relative.values[at], options);
      const float length = so_far + float(step.length_mm + options.mm_per_contrast * change);
      if (length >= distance.values[next] || length > options.most_mm) continue;
      distance.values[next] = length;
      open.Add(length, next);
    }
  }
  return distance;
}

}  // namespace kvx
