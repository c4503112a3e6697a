// A bone as an ellipsoid of marrow in dark cortex and muscle, whose strokes keep to one side of it.
#include "pipeline/segmentation/mr/search/stroke_search.h"

#include <gtest/gtest.h>

#include <random>

namespace kvx {
namespace {

constexpr double kCortexMm = 2.4;
const Eigen::Vector3d kSpacing(1.2, 1.2, 1.5), kRadii(18, 14, 8), kCentre(26, 26, 18);

// Signed, in mm, about.
double Beyond(const Eigen::Vector3d& mm) {
  const Eigen::Vector3d p = mm - kCentre;
  const double k = p.cwiseQuotient(kRadii).norm(), slope = p.cwiseQuotient(kRadii.cwiseAbs2()).norm();
  return slope > 0 ? k * (k - 1) / slope : -kRadii.minCoeff();
}

double Grey(const Eigen::Vector3d& mm) {
  double sum = 0;
  for (int s = 0; s < 8; ++s) {
    const Eigen::Vector3d offset(s & 1 ? .25 : -.25, s & 2 ? .25 : -.25, s & 4 ? .25 : -.25);
    const double beyond = Beyond(mm + offset.cwiseProduct(kSpacing));
    sum += beyond < -kCortexMm ? 160 : beyond < 0 ? 24 : 80;
  }
  return sum / 8;
}

struct World {
  Volume scan;
  LabelMap strokes;
  Mask truth;
};

World MakeWorld() {
  Grid grid;
  grid.size = {64, 44, 24}, grid.spacing_mm = kSpacing;
  World world{Volume(grid), LabelMap(grid), Mask(grid)};
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 6);
  for (size_t v = 0; v < world.scan.values.size(); ++v) {
    const Eigen::Vector3d mm = grid.Ijk(v).cast<double>().cwiseProduct(kSpacing);
    world.scan.values[v] = float(std::abs(Grey(mm) + noise(random)));
    world.truth.values[v] = Beyond(mm) < 0;
  }
  return world;
}

// Lines of five voxels along axes, none beyond `last_i` in the bone.
void Draw(World& world, int last_i) {
  std::mt19937 random(1);
  for (const int label : {1, 255}) {
    for (int drawn = 0; drawn < 12;) {
      const Eigen::Vector3i from(int(random() % 64), int(random() % 44), int(random() % 24));
      const Eigen::Vector3i along = Eigen::Vector3i::Unit(int(random() % 3));
      bool inside = true;
      for (int n = 0; n < 5; ++n) {
        const Eigen::Vector3i p = from + n * along;
        inside = inside && world.truth.grid.Contains(p) &&
                 bool(world.truth(p.x(), p.y(), p.z())) == (label == 1) && (label != 1 || p.x() <= last_i);
      }
      for (int n = 0; inside && n < 5; ++n) {
        const Eigen::Vector3i p = from + n * along;
        world.strokes(p.x(), p.y(), p.z()) = uint16_t(label);
      }
      drawn += inside;
    }
  }
}

double DiceOf(const FoundBone& bone, const Mask& truth) {
  double both = 0, sum = 0;
  for (const uint8_t value : truth.values) sum += value != 0;
  for (size_t v = 0; v < bone.mask.values.size(); ++v) {
    if (!bone.mask.values[v]) continue;
    const Eigen::Vector3i p = bone.mask.grid.Ijk(v) + bone.box.low;
    both += truth(p.x(), p.y(), p.z()) != 0, sum += 1;
  }
  return 2 * both / sum;
}

std::vector<FoundBone> Answers(const World& world) {
  VoxelBox box;
  for (size_t v = 0; v < world.strokes.values.size(); ++v)
    if (world.strokes.values[v] == 1) box.Include(world.strokes.grid.Ijk(v));
  return CutBonesFromStrokes(world.scan, world.strokes, LabelMap(world.scan.grid), {{1, box}},
                             {.shell = true}, {})
      .front();
}

// The answer without a shell stays within the first box, the one with it reaches farther.
TEST(StrokeSearch, AShellThatReachesTheSideOfItsBoxIsLookedForInALargerOne) {
  World world = MakeWorld();
  Draw(world, 22);
  const std::vector<FoundBone> answers = Answers(world);
  ASSERT_EQ(answers.size(), 2u);
  EXPECT_FALSE(answers[0].reaches_box);
  EXPECT_FALSE(answers[1].reaches_box);
  EXPECT_GT(DiceOf(answers[1], world.truth), 0.95);
}

// A larger box may find less: strokes that keep to a third of the bone reach no farther in it.
TEST(StrokeSearch, ALargerBoxThatFindsLessChangesNothing) {
  World world = MakeWorld();
  Draw(world, 14);
  EXPECT_GT(DiceOf(Answers(world)[1], world.truth), 0.7);
}

}  // namespace
}  // namespace kvx
