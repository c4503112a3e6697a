// A mean over the surface would take the clear half of a bone for the whole, a sum a leak for more bone. So
// every face has to be at least half as clear as those of the clearest candidate are.
#include "pipeline/segmentation/mr/search/clearest_bone.h"

#include <algorithm>

#include "pipeline/segmentation/mr/shells/outward_rise.h"

namespace kvx {

size_t ClearestBone(const Volume& scan, double level, std::span<const FoundBone> candidates) {
  constexpr double kPartOfClearest = 0.5, kLeast = 0.05;
  std::vector<SurfaceRise> rises;
  double clearest = 0;
  for (const FoundBone& bone : candidates) {
    rises.push_back(RiseOver(scan, level, bone.box, bone.mask));
    clearest = std::max(clearest, rises.back().Mean());
  }
  const double usual = std::max(kLeast, kPartOfClearest * clearest);
  const auto best =
      std::ranges::max_element(rises, {}, [&](const SurfaceRise& surface) { return surface.Above(usual); });
  return size_t(best - rises.begin());
}

}  // namespace kvx
