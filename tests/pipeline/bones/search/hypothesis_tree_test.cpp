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

}  // namespace
}  // namespace kvx
