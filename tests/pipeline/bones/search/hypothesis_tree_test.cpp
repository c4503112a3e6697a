// A scan of a hinge, and one of nothing but noise: of many ways that a scan is searched in, those that show
// no bone end early, and the one that does goes on.
#include "pipeline/bones/search/hypothesis_tree.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/ellipsoid_world.h"

namespace kvx {
namespace {
using namespace testing_support;

class FindingAllBones : public testing::Test {
 protected:
  std::vector<Candidate> Found(const Volume& scan, Effort effort) const {
    const SoughtBones sought = world_.SoughtIn(scan);
    const BoneSearch search(sought, scan, SharedBackend(), hints_);
    return FindAllBones(search, effort, Progress{}).bones;
  }

  const Grid grid_ = Box({96, 72, 44}, {1.0, 1.1, 1.2}, Eigen::Matrix3d::Identity());
  EllipsoidWorld world_{kHinge, Box({84, 44, 40}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity())};
  std::map<std::string, RigidTransform> hints_;
};

TEST_F(FindingAllBones, GivesUpWhereNoneIsSure) {
  Volume noise(grid_);
  std::mt19937 random(5);
  for (float& value : noise.values) value = float(random()) / float(random.max());
  EXPECT_TRUE(Found(noise, Effort::kWhilePromising).empty());
  EXPECT_EQ(Found(noise, Effort::kToTheEnd).size(), 2) << "each has some place, to be told as doubtful";
}

TEST_F(FindingAllBones, GoesOnWhereTheyShow) {
  const PoseVector truth{RigidTransform{}, RotationAbout(PointMm{{-3, 0, 0}}, {0, 0, 1}, RadFromDeg(40))};
  const std::vector<Candidate> found = Found(Painted(grid_, kHinge, truth), Effort::kWhilePromising);
  ASSERT_EQ(found.size(), 2);
  for (size_t b = 0; b < 2; ++b) EXPECT_LT(AngleDeg(found[b].pose, truth[b]), 3) << b;
}

// A small tip that a scan shows twice: bent far, where it was found and an initial pose has it, and, among
// noise, nearly straight, which its joint likes better by a little more than that.
TEST(LookingAgain, ThePlaceThatABoneLeavesStaysARival) {
  const std::vector<Ellipsoid> bones{{"base", "", {-19, 0, 0}, {18, 8, 7}},
                                     {"tip", "base", {7, 0, 0}, {7, 3.5, 3}}};
  const EllipsoidWorld world(bones, Box({84, 60, 40}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity()));
  const auto bent = [](double deg) {
    return RotationAbout(PointMm{{-0.5, 0, 0}}, {0, 0, 1}, RadFromDeg(deg));
  };
  Volume scan = Painted(Box({84, 60, 40}, {1.0, 1.1, 1.2}, Eigen::Matrix3d::Identity()),
                        {bones[0], bones[1], bones[1]}, {RigidTransform{}, bent(80), bent(-10)});
  std::mt19937 random(6);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const float noise = 60 * (float(random()) / float(random.max()) - 0.5f);
    if (scan.grid.Ijk(v).y() < 30) scan.values[v] += noise;
  }
  const SoughtBones sought = world.SoughtIn(scan);
  const BoneSearch search(sought, scan, SharedBackend(), {{"tip", bent(80)}});
  std::vector<Candidate> found{search.At(0, PartialPose(2), {}),
                               search.At(1, {RigidTransform{}, std::nullopt}, bent(80))};
  LookAgain(search, 1, found);
  EXPECT_LT(AngleDeg(found[1].pose, bent(-10)), 15);
  EXPECT_TRUE(HasRival(found[1]));
}

}  // namespace
}  // namespace kvx
