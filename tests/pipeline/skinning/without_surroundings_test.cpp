// Drawn limbs beside plates, in shells and beside each other.
#include <gtest/gtest.h>

#include "pipeline/skinning/without_surroundings.h"

namespace kvx {
namespace {

// Voxels of 1 mm; limbs run along k, through both ends of the grid.
struct Scene {
  Grid grid;
  Mask body;
  BoneSet bones{{Bone{.label = 7, .name = "femur"}}, {}, {}};

  explicit Scene(double voxel_mm = 1) {
    grid.size = {80, 60, 20};
    grid.spacing_mm = {voxel_mm, voxel_mm, voxel_mm};
    body = Mask(grid);
    bones.labels = LabelMap(grid);
  }

  template <class Inside>
  Mask Drawn(Inside&& inside) const {
    Mask out(grid);
    for (size_t v = 0; v < out.values.size(); ++v) out.values[v] = inside(grid.Ijk(v));
    return out;
  }
  Mask Limb(double i, double j, double radius) const {
    return Drawn([=](const Eigen::Vector3i& p) { return std::hypot(p.x() - i, p.y() - j) < radius; });
  }
  void Add(const Mask& more) {
    for (size_t v = 0; v < body.values.size(); ++v) body.values[v] |= more.values[v];
  }
  void AddBone(double i, double j, double radius) {
    const Mask bone = Limb(i, j, radius);
    for (size_t v = 0; v < bone.values.size(); ++v) bones.labels.values[v] = bone.values[v] ? 7 : 0;
  }
  Mask Result() const { return WithoutSurroundings(body, bones); }
};

size_t Count(const Mask& mask) { return size_t(std::ranges::count(mask.values, 1)); }

size_t CountBoth(const Mask& a, const Mask& b) {
  size_t both = 0;
  for (size_t v = 0; v < a.values.size(); ++v) both += a.values[v] && b.values[v];
  return both;
}

TEST(WithoutSurroundings, ALimbIsKeptToTheLastVoxel) {
  for (const double radius : {2.5, 4.0, 15.0}) {  // a child's finger tip, a finger, an arm
    Scene scene;
    scene.Add(scene.Limb(40, 30, radius));
    scene.AddBone(40, 30, 0.4 * radius);
    EXPECT_EQ(scene.Result().values, scene.body.values) << radius;
  }
}

TEST(WithoutSurroundings, ATableThatTheLimbRestsOnEndsBesideIt) {
  Scene scene;
  const Mask limb = scene.Limb(40, 30, 15.0);
  scene.Add(limb);
  scene.Add(scene.Drawn([](const Eigen::Vector3i& p) { return p.y() >= 44 && p.y() < 48; }));
  scene.AddBone(40, 30, 5);
  const Mask result = scene.Result();
  EXPECT_EQ(CountBoth(result, limb), Count(limb));
  const Mask far = scene.Drawn([](const Eigen::Vector3i& p) { return std::abs(p.x() - 40) > 15; });
  EXPECT_EQ(CountBoth(result, far), 0u);
}

TEST(WithoutSurroundings, ACastAroundPaddingIsLeftOut) {
  Scene scene;
  const Mask limb = scene.Limb(40, 30, 12.0);
  scene.Add(limb);
  scene.Add(scene.Drawn([](const Eigen::Vector3i& p) {
    const double r = std::hypot(p.x() - 40, p.y() - 30);
    return r > 19 && r < 27;  // thicker than a plate that hangs on the limb may be
  }));
  scene.AddBone(40, 30, 5);
  EXPECT_EQ(scene.Result().values, limb.values);
}

TEST(WithoutSurroundings, AThickPieceStays) {
  Scene scene;
  scene.Add(scene.Limb(20, 30, 15));
  scene.Add(scene.Limb(60, 30, 15));
  scene.AddBone(20, 30, 5);
  EXPECT_EQ(scene.Result().values, scene.body.values);
}

TEST(WithoutSurroundings, WithoutBonesEverythingStays) {
  Scene scene;
  scene.Add(scene.Drawn([](const Eigen::Vector3i& p) { return p.y() < 3; }));
  EXPECT_EQ(scene.Result().values, scene.body.values);
}

// A plate that hangs on nothing is thicker in coarse voxels, and a finger only a few of them wide.
TEST(WithoutSurroundings, VoxelsOfThreeMillimetres) {
  Scene scene(3);
  const Mask finger = scene.Limb(40, 30, 2.5);
  scene.Add(finger);
  scene.Add(scene.Drawn([](const Eigen::Vector3i& p) { return p.y() >= 40 && p.y() < 44; }));
  scene.AddBone(40, 30, 1.2);
  EXPECT_EQ(scene.Result().values, finger.values);
}

TEST(WithoutOtherLimbs, TheOtherLegIsLeftOutAndAMarkerStays) {
  Scene scene;
  const Mask limb = scene.Limb(20, 30, 15), marker = scene.Limb(20, 50, 2);
  scene.Add(limb);
  scene.Add(marker);
  Mask expected = scene.body;
  scene.Add(scene.Limb(60, 30, 15));
  scene.AddBone(20, 30, 5);
  EXPECT_EQ(WithoutOtherLimbs(scene.body, scene.bones).values, expected.values);
}

TEST(WithoutOtherLimbs, ALimbInTwoPiecesStays) {
  Scene scene;
  scene.Add(scene.Limb(40, 30, 15));
  for (size_t v = 0; v < scene.body.values.size(); ++v) {
    if (scene.grid.Ijk(v).z() == 9) scene.body.values[v] = 0;  // a band that was saturated
  }
  scene.AddBone(40, 30, 5);
  EXPECT_EQ(WithoutOtherLimbs(scene.body, scene.bones).values, scene.body.values);
}

TEST(WithoutOtherLimbs, EverythingStaysWhereNoPieceHoldsBones) {
  Scene scene;
  scene.Add(scene.Limb(20, 30, 15));
  EXPECT_EQ(WithoutOtherLimbs(scene.body, scene.bones).values, scene.body.values);
  scene.AddBone(60, 30, 5);  // in air
  EXPECT_EQ(WithoutOtherLimbs(scene.body, scene.bones).values, scene.body.values);
}

}  // namespace
}  // namespace kvx
