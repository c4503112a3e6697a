// A block of tissue with a bone in it and air around.
#include "pipeline/registration/tissue/elastic_tissue.h"

#include <gtest/gtest.h>

#include "pipeline/registration/tissue/bone_coat.h"
#include "tests/support/fixtures.h"
#include "tests/support/in_place.h"

namespace kvx {
namespace {
using testing_support::SharedBackend;

struct World {
  WorkRegion region;
  LabelMap bones;
  Mask body;

  World() {
    Grid grid;
    grid.size = {24, 24, 24};
    grid.spacing_mm = {2, 2, 2};
    body = Mask(grid);
    bones = LabelMap(grid);
    for (size_t v = 0; v < grid.VoxelCount(); ++v) {
      const Eigen::Vector3i p = grid.Ijk(v);
      body.values[v] = (p.array() >= 4).all() && (p.array() < 20).all();
      bones.values[v] = body.values[v] && p.x() < 8;
    }
    region.grid = grid;
  }
  Volume BeyondCoatMm() const { return BeyondBoneCoatMm(bones, region); }
  size_t At(int i, int j, int k) const { return region.grid.Index(i, j, k); }
  std::vector<Eigen::Vector3f> AtRest() const { return testing_support::InPlace(region.grid); }
  // A smooth dent of up to 3 mm in the soft part.
  std::vector<Eigen::Vector3f> Dented() const {
    std::vector<Eigen::Vector3f> out = AtRest();
    for (size_t v = 0; v < out.size(); ++v) {
      const double r = (region.grid.Ijk(v) - Eigen::Vector3i(14, 12, 12)).cast<double>().norm() / 6;
      if (r < 1 && !bones.values[v]) out[v].z() += float(3 * (1 - r * r) * (1 - r * r));
    }
    return out;
  }
};

TEST(ElasticTissue, AtRestNothingMoves) {
  const World world;
  std::vector<Eigen::Vector3f> places = world.AtRest();
  const Volume beyond_coat_mm = world.BeyondCoatMm();
  ElasticTissue(world.bones, world.body, beyond_coat_mm, world.region, SharedBackend()).Relax({}, {}, places);
  for (size_t v = 0; v < places.size(); ++v) ASSERT_LT((places[v] - world.AtRest()[v]).norm(), 1e-4);
}

TEST(ElasticTissue, StopsWhenItIsToldTo) {
  const World world;
  const Volume beyond_coat_mm = world.BeyondCoatMm();
  const ElasticTissue tissue(world.bones, world.body, beyond_coat_mm, world.region, SharedBackend());
  for (const int questions : {0, 1}) {  // one a lattice
    int asked = 0;
    std::vector<Eigen::Vector3f> places = world.Dented();
    const Progress progress({}, [&] { return asked++ >= questions; });
    EXPECT_THROW(tissue.Relax({}, progress, places), Cancelled);
  }
}

TEST(ElasticTissue, ADentEvensOutUnlessItIsHeld) {
  const World world;
  const Volume beyond_coat_mm = world.BeyondCoatMm();
  const ElasticTissue tissue(world.bones, world.body, beyond_coat_mm, world.region, SharedBackend());
  const size_t middle = world.At(14, 12, 12), bone = world.At(6, 12, 12);
  const std::vector<Eigen::Vector3f> rest = world.AtRest(), dented = world.Dented();
  std::vector<Eigen::Vector3f> loose = dented, held = dented, sliding = dented;
  tissue.Relax({}, {}, loose);
  const size_t cells = Coarsened(world.region.grid, 2).VoxelCount();
  tissue.Relax(std::vector<Eigen::Matrix3f>(cells, 1e4f * Eigen::Matrix3f::Identity()), {}, held);
  // Held across the dent alone, as by an edge that lies along it: it evens out as if it were loose.
  const Eigen::Matrix3f across = Eigen::Vector3f(1e4f, 1e4f, 0).asDiagonal();
  tissue.Relax(std::vector<Eigen::Matrix3f>(cells, across), {}, sliding);
  EXPECT_LT((loose[middle] - rest[middle]).norm(), 0.3f);
  EXPECT_LT((held[middle] - dented[middle]).norm(), 0.05f);
  EXPECT_LT((sliding[middle] - rest[middle]).norm(), 0.6f);
  for (const auto* places : {&loose, &held, &sliding}) EXPECT_EQ((*places)[bone], rest[bone]);
}

// Two bones with a gap of five voxels that begins and ends between the coarser lattices' nodes. One of them
// has slid 3 mm along the other, and at first the tissue between them has gone with it. How far it is in the
// end, across the gap.
std::vector<double> ShearOfAGap(const Volume& beyond_coat_mm) {
  World world;
  std::vector<Eigen::Vector3f> places = world.AtRest();
  for (size_t v = 0; v < places.size(); ++v) {
    const int x = world.region.grid.Ijk(v).x();
    world.body.values[v] = 1;
    world.bones.values[v] = x < 9 || x >= 14;
    if (x >= 9) places[v].y() += 3;
  }
  ElasticTissue(world.bones, world.body, beyond_coat_mm, world.region, SharedBackend()).Relax({}, {}, places);
  std::vector<double> out;
  for (int x = 9; x < 14; ++x) {
    const size_t v = world.At(x, 12, 12);
    out.push_back(places[v].y() - world.AtRest()[v].y());
  }
  return out;
}

constexpr double kNearlyMm = 0.15;  // a twentieth of the shear: it is not relaxed to the end

TEST(ElasticTissue, AGapBetweenBonesIsShearedEvenly) {
  const World world;
  const std::vector<double> shear_mm = ShearOfAGap(Volume(world.region.grid, 0.0f));
  for (int n = 0; n < 5; ++n) EXPECT_NEAR(shear_mm[size_t(n)], 3 * (n + 1) / 6.0, kNearlyMm) << n;
}

// A coat of half a voxel fills the frames beside either bone: they are ten times as stiff, and take a tenth
// of the shear of each of the four frames between.
TEST(ElasticTissue, TheCoatOfABoneGoesWithIt) {
  const World world;
  const double coat_mm = 0.5 * world.region.grid.spacing_mm.x();
  Volume beyond_coat_mm(world.region.grid, float(coat_mm));
  for (size_t v = 0; v < beyond_coat_mm.values.size(); ++v) {
    const int x = world.region.grid.Ijk(v).x();
    if (x < 9 || x >= 14) beyond_coat_mm.values[v] = float(-coat_mm);
  }
  const std::vector<double> shear_mm = ShearOfAGap(beyond_coat_mm);
  EXPECT_NEAR(shear_mm.front(), 3 * 0.1 / 4.2, kNearlyMm);
  EXPECT_NEAR(shear_mm[2], 1.5, kNearlyMm);
  EXPECT_NEAR(shear_mm.back(), 3 * 4.1 / 4.2, kNearlyMm);
}

// A bar between two bones that have come apart along it: what lies in the middle goes half of the way,
// however many voxels it is from either bone.
TEST(ElasticTissue, ALongBarStretchesEvenly) {
  WorkRegion region;
  region.grid.size = {208, 24, 24};
  const Mask body(region.grid, 1);
  LabelMap bones(region.grid);
  std::vector<Eigen::Vector3f> places;
  for (size_t v = 0; v < region.grid.VoxelCount(); ++v) {
    const Eigen::Vector3i p = region.grid.Ijk(v);
    bones.values[v] = p.x() <= 72 || p.x() >= 136;
    places.push_back(p.cast<float>());
    if (p.x() >= 136) places.back().x() += 3;
  }
  const Volume far_mm(region.grid, 100.0f);
  ElasticTissue(bones, body, far_mm, region, SharedBackend()).Relax({}, {}, places);
  for (const int x : {88, 104, 120})
    EXPECT_NEAR(places[region.grid.Index(x, 12, 12)].x() - float(x), 3 * (x - 72) / 64.0, kNearlyMm) << x;
}

TEST(ElasticTissue, AirGoesWithTheTissueNearestToIt) {
  const World world;
  std::vector<Eigen::Vector3f> places = world.Dented();
  const std::vector<Eigen::Vector3f> before = places;
  const Volume beyond_coat_mm = world.BeyondCoatMm();
  ElasticTissue(world.bones, world.body, beyond_coat_mm, world.region, SharedBackend()).Relax({}, {}, places);
  const size_t skin = world.At(14, 12, 19), air = world.At(14, 12, 22);
  EXPECT_LT(((places[air] - before[air]) - (places[skin] - before[skin])).norm(), 1e-6f);
}

}  // namespace
}  // namespace kvx
