// The images that a registration compares, of a template that ends inside the body.
#include "pipeline/registration/images/level_images.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "pipeline/artifacts/held.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// Of one grey each but for noughts that a program added to the template at its ends.
Volume TemplateAsCompared(int filled_planes) {
  const Grid grid = ObliqueGrid({16, 12, 20});
  Scan shown{Volume(grid, 100.0f)};
  for (size_t v = 0; v < shown.volume.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v);
    shown.volume.values[v] += float(p.x() + p.y());
    if (p.z() >= grid.size.z() - filled_planes) shown.volume.values[v] = 0;
  }
  const auto image = Held(shown);
  const auto body = Held(Mask(grid, 1));
  const auto bones = Held(BoneSet{{}, LabelMap(grid)});
  const auto weights = Held(WeightMap(grid));
  const auto fits = Held(BoneFits());
  const WorkRegion region = RegionAround(*body);
  const Volume beyond_coat_mm(region.grid, 1e3f);
  return PrepareImages({image, body, bones, weights, fits, image}, {1, 1, 1}, beyond_coat_mm, region,
                       Pyramid(SharedBackend()))
      .template_volume;
}

// Noughts there would be an edge at every cut end.
TEST(LevelImages, BeyondTheTemplateAreTheGreysOfItsBorder) {
  for (const int filled_planes : {0, 5}) {
    const Volume volume = TemplateAsCompared(filled_planes);
    EXPECT_GE(*std::min_element(volume.values.begin(), volume.values.end()), 100) << filled_planes;
    EXPECT_EQ(volume(8, 8, 0), volume(8, 8, 8)) << "the first column, as it is on the border";
    EXPECT_EQ(volume(20, 16, volume.grid.size.z() - 1), volume(20, 16, 8));
  }
}

}  // namespace
}  // namespace kvx
