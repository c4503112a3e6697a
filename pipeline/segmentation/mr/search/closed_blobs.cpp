// From a bright place straight ways go out in all directions, each up to the first valley of the intensity.
// The place moves to the middle of the walls that they come to, and so on.
#include "pipeline/segmentation/mr/search/closed_blobs.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"
#include "core/voxels/sample_clamped.h"
#include "pipeline/segmentation/mr/levels/marrow_level.h"

namespace kvx {
namespace {

constexpr double kFall = 0.2, kRise = 0.08;  // of relative intensity, into a valley and out of it
constexpr double kDark = 0.45;               // a valley that need not end
constexpr double kStep = 0.5;                // voxels
constexpr int kWays = 96, kFewWays = 24, kMoves = 3;
constexpr double kNearest = 0.45, kFarthest = 1.9;  // of the radius: at about the same distance
constexpr double kLeastClosed = 0.85, kLeastVoxels = 1.5;
constexpr double kSame = 0.7;  // of the larger radius: centres that are nearer are of one blob

using Place = Eigen::Vector3d;

// Evenly over the sphere, on a spiral.
std::vector<Place> Directions(int count) {
  std::vector<Place> directions;
  const double turn = kPi * (3 - std::sqrt(5.0));
  for (int n = 0; n < count; ++n) {
    const double z = 1 - (2 * n + 1.0) / count, across = std::sqrt(1 - z * z);
    directions.emplace_back(across * std::cos(turn * n), across * std::sin(turn * n), z);
  }
  return directions;
}

PointVox VoxelAt(const Grid& grid, const Place& mm) {
  return PointVox{mm.cwiseProduct(grid.spacing_mm.cwiseInverse())};
}

// Of the 27 places of a small cube.
double MeanAround(const Volume& relative, const Place& mm) {
  constexpr double kVoxels = 0.7;
  const double step_mm = kVoxels * relative.grid.MeanSpacingMm();
  double sum = 0;
  for (int n = 0; n < 27; ++n) {
    const Place at = mm + step_mm * Place(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    sum += SampleClamped(relative, VoxelAt(relative.grid, at));
  }
  return sum / 27;
}

class Looker {
 public:
  Looker(const Volume& relative, double most_mm)
      : relative_(relative), step_mm_(kStep * relative.grid.MeanSpacingMm()), most_mm_(most_mm) {}

  std::optional<ClosedBlob> From(Place centre) const {
    ClosedBlob blob;
    for (int move = 0; move < kMoves; ++move) {
      const std::optional<Place> middle = Look(centre, few_, blob);
      if (!middle || blob.closed < kRoughlyClosed) return std::nullopt;
      centre += kMostOfMove * *middle;
    }
    if (!Look(centre, all_, blob) || blob.closed < kLeastClosed) return std::nullopt;
    return blob;
  }

 private:
  static constexpr double kMostOfMove = 0.8;     // a whole one swings
  static constexpr double kRoughlyClosed = 0.5;  // from a place that is not the middle

  // To the valley's deepest place; 0 without a valley.
  double WallOn(const Place& from, const Place& direction, double bright) const {
    double least = bright, at = 0;
    for (double way = step_mm_; way < most_mm_; way += step_mm_) {
      const PointVox p = VoxelAt(relative_.grid, from + way * direction);
      if (!relative_.grid.Contains(p)) return 0;
      const double here = SampleTrilinear(relative_, p);
      if (here < least) least = here, at = way;
      if (bright - least >= kFall && (here - least >= kRise || least < kDark)) return at;
    }
    return 0;
  }

  // The way to the walls' middle from here; none from a dark place, or where hardly a wall is.
  std::optional<Place> Look(const Place& centre, const std::vector<Place>& directions,
                            ClosedBlob& blob) const {
    if (!relative_.grid.Contains(VoxelAt(relative_.grid, centre))) return std::nullopt;
    const double bright = MeanAround(relative_, centre);
    if (bright < kSurelyMarrow) return std::nullopt;
    std::vector<double> ways, walls;
    for (const Place& direction : directions) {
      ways.push_back(WallOn(centre, direction, bright));
      if (ways.back() > 0) walls.push_back(ways.back());
    }
    if (walls.empty()) return std::nullopt;
    blob = {.centre_mm = centre, .radius_mm = TakeMedian(walls)};
    Place middle = Place::Zero();
    int even = 0;
    for (size_t n = 0; n < ways.size(); ++n) {
      if (ways[n] == 0) continue;
      middle += std::min(ways[n], 2 * blob.radius_mm) * directions[n];
      even += ways[n] > kNearest * blob.radius_mm && ways[n] < kFarthest * blob.radius_mm;
    }
    middle *= 3 / double(ways.size());  // of a ball's walls about a place aside, the way to its middle
    blob.closed = even / double(ways.size());
    blob.aside = middle.norm() / blob.radius_mm;
    return middle;
  }

  const Volume& relative_;
  const double step_mm_, most_mm_;
  const std::vector<Place> few_ = Directions(kFewWays), all_ = Directions(kWays);
};

// Of every second voxel along every axis.
std::vector<Place> BrightPlaces(const Volume& relative, const Mask& where) {
  std::vector<Place> places;
  for (size_t v = 0; v < where.values.size(); ++v) {
    if (!where.values[v] || relative.values[v] < kSurelyMarrow) continue;
    const Eigen::Array3i p = relative.grid.Ijk(v);
    if ((p / 2 * 2 == p).all())
      places.push_back(p.cast<double>().matrix().cwiseProduct(relative.grid.spacing_mm));
  }
  return places;
}

bool IsSame(const ClosedBlob& a, const ClosedBlob& b) {
  return (a.centre_mm - b.centre_mm).norm() < kSame * std::max(a.radius_mm, b.radius_mm);
}

}  // namespace

bool IsWalled(const Volume& relative, const Place& from_mm, const Place& to_mm) {
  constexpr double kEndVoxels = 1.5;
  const double length_mm = (to_mm - from_mm).norm(), voxel_mm = relative.grid.MeanSpacingMm();
  const double step_mm = kStep * voxel_mm, end_mm = std::min(kEndVoxels * voxel_mm, length_mm);
  const auto at = [&](double way) {
    const Place mm = from_mm + way / std::max(length_mm, 1e-9) * (to_mm - from_mm);
    return double(SampleClamped(relative, VoxelAt(relative.grid, mm)));
  };
  double first = 0, last = 0, least = INFINITY;
  int ends = 0;
  for (double way = 0; way <= end_mm; way += step_mm) first += at(way), last += at(length_mm - way), ++ends;
  for (double way = 0; way <= length_mm; way += step_mm) least = std::min(least, at(way));
  return std::min(first, last) / ends - least >= kFall;
}

std::vector<ClosedBlob> FindClosedBlobs(const Volume& relative, const Mask& where, double most_mm) {
  constexpr double kAsideCosts = 0.3;
  const std::vector<Place> places = BrightPlaces(relative, where);
  const Looker looker(relative, most_mm);
  std::vector<std::optional<ClosedBlob>> seen(places.size());
  ParallelFor(places.size(), [&](size_t n) { seen[n] = looker.From(places[n]); });
  std::vector<ClosedBlob> ranked;
  for (const std::optional<ClosedBlob>& blob : seen) {
    if (blob && blob->radius_mm >= kLeastVoxels * relative.grid.MeanSpacingMm()) ranked.push_back(*blob);
  }
  std::ranges::stable_sort(ranked, std::ranges::greater(),
                           [](const ClosedBlob& blob) { return blob.closed - kAsideCosts * blob.aside; });
  std::vector<ClosedBlob> blobs;
  for (const ClosedBlob& blob : ranked) {
    if (std::ranges::none_of(blobs, [&](const ClosedBlob& better) { return IsSame(better, blob); }))
      blobs.push_back(blob);
  }
  return blobs;
}

}  // namespace kvx
