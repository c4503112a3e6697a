// One value from the border on may be air, too, where a program masked it. But beside masked air there is
// skin, and beside filling mostly air with its noise.
#include "pipeline/scans/filled_corners.h"

#include <algorithm>
#include <array>

#include "core/host/parallel.h"
#include "core/voxels/components.h"
#include "core/voxels/distance_transform.h"
#include "core/voxels/to_corner.h"
#include "pipeline/scans/air_level.h"
#include "pipeline/scans/extremes.h"
#include "pipeline/scans/grey_kind.h"

namespace kvx {
namespace {

constexpr double kLeastShare = 0.01;  // of the scan's voxels
constexpr double kMixedVoxels = 2;    // beside filling, by interpolation and smoothing
// Where air is looked for: farther from masked air than what is left of air around the skin.
constexpr double kNearVoxels = 6, kFarVoxels = 10;
constexpr double kAirBeside = 0.5;  // share of air there beside filling; 0.1 is much beside masked air
constexpr double kNoiseSpreads = 3;

std::array<float, 8> CornersOf(const Volume& scan) {
  std::array<float, 8> corners;
  for (int c = 0; c < 8; ++c) {
    const Eigen::Vector3i p = (scan.grid.size.array() - 1) * ToCorner(c).array();
    corners[c] = scan(p.x(), p.y(), p.z());
  }
  return corners;
}

// The value of most corners.
float CornerValue(const Volume& scan) {
  const std::array<float, 8> corners = CornersOf(scan);
  const auto how_many = [&](float value) { return std::count(corners.begin(), corners.end(), value); };
  return *std::max_element(corners.begin(), corners.end(),
                           [&](float a, float b) { return how_many(a) < how_many(b); });
}

// Voxels of the corners' value that hang together with the border; distances count in voxels.
Mask OneValueFromTheBorder(const Volume& scan) {
  Mask same(scan.grid);
  same.grid.spacing_mm.setOnes();
  const float value = CornerValue(scan);
  ParallelEach(same.values.size(), [&](size_t v) { same.values[v] = scan.values[v] == value; });
  return PiecesAtBorder(same);
}

// Of all that is not of the one value.
std::optional<AirLevel> AirOfTheRest(const Volume& scan, const std::string& modality, const Mask& one_value) {
  const size_t slices = size_t(scan.grid.size.z()), voxels = scan.values.size() / slices;  // of a slice
  Volume rest;
  rest.values = ParallelCollect<float>(slices, [&](std::vector<float>& values, size_t k) {
    for (size_t v = k * voxels; v < (k + 1) * voxels; ++v)
      if (!one_value.values[v]) values.push_back(scan.values[v]);
  });
  if (rest.values.empty()) return std::nullopt;
  rest.grid.size = {int(rest.values.size()), 1, 1};
  return FindAirLevel(rest, modality);
}

bool AirLiesBeside(const Volume& scan, const AirLevel& air, const Volume& voxels_away) {
  struct Beside {
    size_t dark = 0, all = 0;
    Beside& operator+=(const Beside& other) {
      dark += other.dark, all += other.all;
      return *this;
    }
  };
  const auto [dark, all] = ParallelSum<Beside>(voxels_away.values.size(), [&](Beside& so_far, size_t v) {
    if (voxels_away.values[v] <= kNearVoxels || voxels_away.values[v] > kFarVoxels) return;
    const bool is_dark = scan.values[v] <= air.air + kNoiseSpreads * air.spread;  // also air of one value
    so_far += {is_dark, 1};
  });
  return all > 0 && double(dark) >= kAirBeside * double(all);
}

struct Filling {
  Mask one_value;      // its grid's voxels are 1 mm wide
  Volume voxels_away;  // from it, as far as kFarVoxels
  AirLevel air;
};

std::optional<Filling> FindFilling(const Volume& scan, const std::string& modality) {
  Filling filling{.one_value = OneValueFromTheBorder(scan)};
  const Mask& one_value = filling.one_value;
  const auto count = std::count(one_value.values.begin(), one_value.values.end(), 1);
  if (double(count) < kLeastShare * double(one_value.values.size())) return std::nullopt;
  const std::optional<AirLevel> air = AirOfTheRest(scan, modality, one_value);
  if (!air) return std::nullopt;
  filling.air = *air;
  filling.voxels_away = DistanceMapMm(one_value, kFarVoxels);
  if (!AirLiesBeside(scan, *air, filling.voxels_away)) return std::nullopt;
  return filling;
}

}  // namespace

Mask FilledCorners(const Volume& scan, const std::string& modality) {
  const std::optional<Filling> filling = FindFilling(scan, modality);
  if (!filling) return {};
  Mask filled(scan.grid);
  ParallelEach(filled.values.size(),
               [&](size_t v) { filled.values[v] = filling->voxels_away.values[v] <= kMixedVoxels; });
  return filled;
}

Volume WithAirInCorners(Volume scan, const std::string& modality) {
  const std::optional<Filling> filling = FindFilling(scan, modality);
  if (!filling) return scan;
  const AirLevel& air = filling->air;
  if (CornerValue(scan) >= air.air - kNoiseSpreads * air.spread) return scan;
  ParallelEach(scan.values.size(), [&](size_t v) {
    if (filling->one_value.values[v]) scan.values[v] = float(air.air);
  });
  return scan;
}

Volume WithoutImpossibleFilling(Volume scan, const std::string& modality) {
  if (IsHounsfield(scan, modality)) {
    for (float& grey : scan.values) grey = std::max(grey, kLeastHu);
    return scan;
  }
  const auto [least, most] = std::ranges::minmax(CornersOf(scan));
  for (const float filling : {least, most}) {
    if (const std::optional<double> zero = ZeroInPlaceOf(filling, scan))
      std::ranges::replace(scan.values, filling, float(*zero));
  }
  return scan;
}

}  // namespace kvx
