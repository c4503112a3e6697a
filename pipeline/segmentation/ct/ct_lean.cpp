// No way within a bone costs more than a diagonal of its strokes; a fall by one unit costs ten.
#include "pipeline/segmentation/ct/ct_lean.h"

#include <algorithm>
#include <cmath>

#include "pipeline/segmentation/ct/ct_border.h"
#include "pipeline/segmentation/strokes/geodesic.h"

namespace kvx {
namespace {

constexpr double kDiagonalsPerUnit = 10;

Image<float> Ways(const CtWays& ways, const Mask& from, GeodesicOptions::Paid paid, double most_mm) {
  std::vector<GeodesicSource> sources;
  for (size_t v = 0; v < from.values.size(); ++v) {
    if (from.values[v]) sources.push_back({v, 0});
  }
  return GeodesicDistance(ways.density, sources,
                          {.mm_per_contrast = kDiagonalsPerUnit * ways.diagonal_mm,
                           .noise = ways.noise_hu / kDensityUnitHu,
                           .most_mm = most_mm,
                           .paid = paid,
                           .within = ways.within});
}

}  // namespace

Image<float> CtWays::PayingFalls(const Mask& from, double most_mm) const {
  return Ways(*this, from, GeodesicOptions::kFalls, most_mm);
}

Image<float> CtWays::PayingRises(const Mask& from, double most_mm) const {
  return Ways(*this, from, GeodesicOptions::kRises, most_mm);
}

float LeanOf(float own_mm, float other_mm) {
  if (!std::isfinite(own_mm)) return -1;
  return std::clamp(2 * (other_mm - own_mm) / std::max(other_mm + own_mm, 1e-6f), -1.0f, 1.0f);
}

}  // namespace kvx
