// What is dense is bone for sure; what is not may be marrow, so it says little. Smaller voxels say less each,
// and a fall of density is spread over more of them.
#include "pipeline/segmentation/ct/ct_border.h"

#include <algorithm>
#include <cmath>

#include "core/numbers/quantile.h"

namespace kvx {
namespace {

constexpr float kLowHu = 0, kHighHu = 600;
constexpr double kBoneHu = 150, kBoneScaleHu = 50;  // for sure, with a say of one nat per scale
constexpr double kBoneNats = 2, kSoftNats = 0.3;    // most say: marrow looks like soft tissue
constexpr double kLeanNats = 3, kLinkNats = 6;
constexpr double kLeastEdgeHu = 60;

}  // namespace

Volume DensityOf(Volume scan_hu) {
  for (float& v : scan_hu.values) v = std::clamp(v, kLowHu, kHighHu) / kDensityUnitHu;
  return scan_hu;
}

double NoiseHu(const Volume& scan_hu) {
  constexpr float kSoftLowHu = -200, kSoftHighHu = 150;
  constexpr double kUsual = 20, kLeast = 10, kMost = 60;
  constexpr size_t kEnough = 100, kPlenty = 8'000'000;
  const auto soft = [](float hu) { return hu > kSoftLowHu && hu < kSoftHighHu; };
  std::vector<float> changes;
  for (size_t v = 0; v + 1 < scan_hu.values.size(); v += 1 + scan_hu.values.size() / kPlenty) {
    if ((v + 1) % size_t(scan_hu.grid.size.x()) == 0) continue;
    if (soft(scan_hu.values[v]) && soft(scan_hu.values[v + 1]))
      changes.push_back(std::abs(scan_hu.values[v + 1] - scan_hu.values[v]));
  }
  if (changes.size() < kEnough) return kUsual;
  return std::clamp(TakeMedian(changes) / kMadOfPairs, kLeast,
                    kMost);  // the median of |a - b| of two normal deviates
}

Mask CtBorder(const Volume& density, const Image<float>& lean, const Image<Side>& sides, double noise_hu,
              double detail) {
  CutLayer layer{Image<float>(density.grid),
                 sides,
                 {.strength = kLinkNats,
                  .contrast = std::max(detail * kLeastEdgeHu, 2 * noise_hu) / kDensityUnitHu,
                  .falls_outwards = 1}};
  for (size_t v = 0; v < lean.values.size(); ++v) {
    const double hu = double(density.values[v]) * kDensityUnitHu;
    const double looks = std::clamp((hu - kBoneHu) / kBoneScaleHu, -kSoftNats, kBoneNats);
    layer.inside_cost.values[v] = float(detail * (-looks - kLeanNats * lean.values[v]));
  }
  return MinimumCut(std::move(layer), density);
}

}  // namespace kvx
