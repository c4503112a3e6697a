// The images that a registration compares, of a template that ends inside the body.
#include "pipeline/registration/images/level_images.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "pipeline/artifacts/held.h"
#include "pipeline/registration/images/noise.h"
#include "tests/support/fixtures.h"
#include "tests/support/in_place.h"
#include "tests/support/shared_noise.h"

namespace kvx {
namespace {
using namespace testing_support;

// Of one grey each but for noughts that a program added to the template at its ends.
Volume TemplateAsCompared(int filled_planes) {
  const Grid grid = ObliqueGrid({16, 12, 20});
  Scan shown{.volume = Volume(grid, 100.0f), .modality = "CT"};  // of MR it would be taken for the origin
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

// The scan shows the first half of the same limb, by the same scanner; the other half is much fatter.
TEST(LevelImages, TissueThatOnlyTheTemplateShowsDoesNotChangeTheScansContrast) {
  const Grid grid = ObliqueGrid({24, 24, 48});
  Scan shown{Volume(grid)};
  for (size_t v = 0; v < shown.volume.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v);
    const bool fat = (p.x() / 6 + p.y() / 6 + p.z() / 6) % 2 == 0 || p.z() >= 24;
    shown.volume.values[v] = (fat ? 200.0f : 80.0f) + float((7 * p.x() + 5 * p.y() + 3 * p.z()) % 9);
  }
  Scan half = shown;
  half.volume.grid.size.z() = 24;
  half.volume.values.resize(half.volume.grid.VoxelCount());
  const auto image = Held(shown), scan = Held(half);
  const auto body = Held(Mask(grid, 1));
  const auto bones = Held(BoneSet{{}, LabelMap(grid)});
  const auto weights = Held(WeightMap(grid));
  const auto fits = Held(BoneFits());
  const RegistrationInputs inputs{image, body, bones, weights, fits, scan};
  const WorkRegion region = RegionAround(*body);
  const Volume beyond_coat_mm(region.grid, 1e3f);
  const LevelImages images =
      PrepareImages(inputs, {1, 1, 1}, beyond_coat_mm, region, Pyramid(SharedBackend()));
  const BlockLevel level = FinestLevel(inputs, images, InPlace(region.grid), region);
  float largest = 0, least = 1e9f, most = -1e9f;
  ForEachVoxel({{4, 4, 4}, {20, 20, 18}}, [&](const Eigen::Vector3i& p) {
    const Eigen::Vector3i at = p - region.first;
    const float seen = level.intensity[level.grid.Index(at.x(), at.y(), at.z())];
    largest = std::max(largest, std::abs(seen - level.scan(p.x(), p.y(), p.z())));
    least = std::min(least, seen), most = std::max(most, seen);
  });
  EXPECT_LT(largest, 0.02f * (most - least));
}

// A voxel of 3 x 1 x 3 mm shows as much as either does then: three of the template's.
TEST(LevelImages, SlicesAcrossEachOtherShareTheirMeasurements) {
  Grid grid = ObliqueGrid({24, 24, 8}), across = ObliqueGrid({8, 24, 24});
  grid.spacing_mm = {1, 1, 3}, across.spacing_mm = {3, 1, 1};
  grid.origin = across.origin = {};
  const auto image = Held(Scan{LinearRamp().On(grid)}), scan = Held(Scan{LinearRamp().On(across)});
  const auto body = Held(Mask(grid, 1));
  const auto bones = Held(BoneSet{{}, LabelMap(grid)});
  const auto weights = Held(WeightMap(grid));
  const auto fits = Held(BoneFits(1));  // stays where it is
  const WorkRegion region = RegionAround(*body);
  const Volume beyond_coat_mm(region.grid, 1e3f);
  const auto level_of = [&](const Artifact<Scan>& shown) {
    const RegistrationInputs inputs{image, body, bones, weights, fits, shown};
    const LevelImages images =
        PrepareImages(inputs, {1, 1, 1}, beyond_coat_mm, region, Pyramid(SharedBackend()));
    return FinestLevel(inputs, images, InPlace(region.grid), region);
  };
  EXPECT_NEAR(level_of(image).voxels_a_measurement, 1, 1e-6);
  EXPECT_NEAR(level_of(scan).voxels_a_measurement, 3, 0.3);
}

// One image was interpolated, the other measured voxel by voxel.
TEST(LevelImages, VoxelsThatShareTheirNoiseShareAMeasurement) {
  const auto interpolated = Held(Scan{RampWithSharedNoise(2)}), measured = Held(Scan{RampWithSharedNoise(0)});
  const Grid& grid = interpolated->volume.grid;
  const auto body = Held(Mask(grid, 1));
  const auto bones = Held(BoneSet{{}, LabelMap(grid)});
  const auto weights = Held(WeightMap(grid));
  const auto fits = Held(BoneFits(1));  // stays where it is
  const WorkRegion region = RegionAround(*body);
  const Volume beyond_coat_mm(region.grid, 1e3f);
  const RegistrationInputs inputs{interpolated, body, bones, weights, fits, measured};
  const LevelImages images =
      PrepareImages(inputs, {1, 1, 1}, beyond_coat_mm, region, Pyramid(SharedBackend()));
  const BlockLevel level = FinestLevel(inputs, images, InPlace(region.grid), region);
  EXPECT_NEAR(level.voxels_a_measurement, 0.5 * (VoxelsSharingNoise(interpolated->volume) + 1), 1e-6);
  EXPECT_GT(level.voxels_a_measurement, 1.6);
}

}  // namespace
}  // namespace kvx
