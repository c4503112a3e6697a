// What landed on posed voxels, shown and mended.
#include <algorithm>
#include <map>
#include <optional>

#include "core/voxels/neighbours.h"
#include "core/voxels/to_corner.h"
#include "kernels/evd_specks.h"
#include "kernels/reference/evd.h"

namespace kvx::reference {
namespace {

using Eigen::Vector3d, Eigen::Vector3i;

bool IsTissue(const std::vector<Landing>& landings, const Grid& grid, const Vector3i& at) {
  if (!grid.Contains(at)) return false;
  const int claim = landings[grid.Index(at.x(), at.y(), at.z())].claim;
  return claim != kMargin && claim != kUnclaimed;
}

bool IsInner(const std::vector<Landing>& landings, const Grid& grid, const Vector3i& at) {
  return IsTissue(landings, grid, at) && landings[grid.Index(at.x(), at.y(), at.z())].claim != kRim;
}

// The voxels beside that inner tissue claims.
std::vector<size_t> InnerBeside(const std::vector<Landing>& landings, const Grid& grid, size_t v) {
  std::vector<size_t> out;
  for (int side = 0; side < 6; ++side) {
    const Vector3i beside = grid.Ijk(v) + StepToSide(side);
    if (IsInner(landings, grid, beside)) out.push_back(grid.Index(beside.x(), beside.y(), beside.z()));
  }
  return out;
}

// Fills with what `like` makes of the voxels beside, and clears to `air`.
template <class T, class Like>
void Mend(const std::vector<Landing>& landings, const Grid& template_grid, T air, const Like& like,
          Image<T>& shown) {
  const std::vector<Mending> mending = EvdMending(landings, shown.grid, template_grid);
  for (size_t v = 0; v < mending.size(); ++v)
    if (mending[v] == Mending::kFill) shown.values[v] = like(InnerBeside(landings, shown.grid, v));
  for (size_t v = 0; v < mending.size(); ++v)
    if (mending[v] == Mending::kClear) shown.values[v] = air;
}

// The place where something landed, in the template's grid; nothing where it lies beyond.
std::optional<Vector3d> PlaceWithin(const Landing& landing, const Grid& template_grid) {
  if (landing.claim == kUnclaimed) return {};
  const Vector3d top = (template_grid.size.array() - 1).cast<double>();
  const Vector3d inside = landing.place.cwiseMax(0.0).cwiseMin(top);
  if ((inside - landing.place).cwiseAbs().maxCoeff() >= 0.51) return {};
  return inside;
}

// The label with the greatest share, of its level, where 0 has less than that label has of the rest.
uint16_t Prevailing(const LabelMap& labels, const std::vector<float>& levels, const Vector3d& p) {
  const Vector3i low = p.cast<int>();
  std::map<uint16_t, double> shares;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3i to = ToCorner(corner);
    const Vector3i at = (low + to).cwiseMin((labels.grid.size.array() - 1).matrix());
    double share = 1;
    for (int a = 0; a < 3; ++a) share *= to[a] ? p[a] - low[a] : 1 - (p[a] - low[a]);
    shares[labels(at.x(), at.y(), at.z())] += share;
  }
  uint16_t winner = 0;
  double most = 0;
  for (const auto& [label, share] : shares)
    if (label != 0 && share / levels[label] > most) most = share / levels[label], winner = label;
  return most * (1 - levels[winner]) >= shares[0] ? winner : 0;
}

}  // namespace

std::vector<Mending> EvdMending(const std::vector<Landing>& landings, const Grid& grid,
                                const Grid& template_grid) {
  const bool clears = HoldsSpecks(grid, template_grid);
  const auto may_be_tissue = [&](const Vector3i& at) {
    return !grid.Contains(at) || IsTissue(landings, grid, at);
  };
  std::vector<Mending> out(landings.size(), Mending::kNone);
  for (size_t v = 0; v < out.size(); ++v) {
    int between = 0, beside = 0;
    for (int a = 0; a < 3; ++a) {
      const Vector3i low = grid.Ijk(v) - Vector3i::Unit(a), high = grid.Ijk(v) + Vector3i::Unit(a);
      between += IsInner(landings, grid, low) && IsInner(landings, grid, high);
      beside += may_be_tissue(low) + may_be_tissue(high);
    }
    if (!IsInner(landings, grid, grid.Ijk(v)) && between >= 2) out[v] = Mending::kFill;
    if (clears && beside == 0 && IsTissue(landings, grid, grid.Ijk(v))) out[v] = Mending::kClear;
  }
  return out;
}

Volume EvdIntensities(const std::vector<Landing>& landings, const Grid& grid, const Volume& image,
                      float air) {
  Volume out(grid, air);
  for (size_t v = 0; v < landings.size(); ++v)
    if (const auto place = PlaceWithin(landings[v], image.grid))
      out.values[v] = SampleTrilinear(image, PointVox{*place}, air);
  const auto mean = [&](const std::vector<size_t>& beside) {
    double sum = 0;
    for (const size_t n : beside) sum += out.values[n];
    return float(sum / double(beside.size()));
  };
  Mend(landings, image.grid, air, mean, out);
  return out;
}

LabelMap EvdLabels(const std::vector<Landing>& landings, const Grid& grid, const LabelMap& labels,
                   const std::vector<float>& levels) {
  LabelMap out(grid);
  for (size_t v = 0; v < landings.size(); ++v)
    if (const auto place = PlaceWithin(landings[v], labels.grid))
      out.values[v] = Prevailing(labels, levels, *place);
  const auto most_frequent = [&](const std::vector<size_t>& beside) {
    return out.values[*std::ranges::max_element(beside, {}, [&](size_t n) {
      return std::ranges::count_if(beside, [&](size_t m) { return out.values[m] == out.values[n]; });
    })];
  };
  Mend(landings, labels.grid, uint16_t(0), most_frequent, out);
  return out;
}

}  // namespace kvx::reference
