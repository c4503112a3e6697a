// Two ellipsoids under one label, which move together or not.
#include "pipeline/bones/judge/unlike_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/ellipsoid_hinge.h"

namespace kvx {
namespace {
using namespace testing_support;

// All labelled voxels of the hinge as one bone.
BoneTissue BothAsOne(const Hinge& hinge) {
  const Volume& image = hinge.world.template_scan->volume;
  BoneTissue tissue;
  tissue.centre.lps.setZero();
  for (size_t v = 0; v < image.values.size(); ++v) {
    if (hinge.world.bones->labels.values[v] == 0) continue;
    TissueSample sample{};
    sample.from_centre_mm = image.grid.ToMm(PointVox{image.grid.Ijk(v).cast<double>()}).lps;
    sample.value = image.values[v], sample.own_weight = 1;
    tissue.samples.push_back(sample);
  }
  return tissue;
}

BoneFit NamedIn(const Hinge& hinge, const PoseVector& bones_moved, const BoneTissue& of_both) {
  const Volume scan =
      Painted(Box({90, 66, 46}, {1.0, 1.05, 1.1}, Eigen::Matrix3d::Identity()), kHinge, bones_moved);
  BoneFits fits(1);
  fits[0].scan_from_template = hinge.truth[0];
  const std::vector<BoneTissue> tissue{of_both};
  BoneSet as_one = *hinge.world.bones;
  as_one.bones.resize(1);
  for (uint16_t& value : as_one.labels.values) value = value ? uint16_t(as_one.bones[0].label) : 0;
  NameUnlikeParts(as_one, tissue, CubicImage(scan), fits);
  return fits[0];
}

BoneFit NamedIn(const Hinge& hinge, const PoseVector& bones_moved) {
  return NamedIn(hinge, bones_moved, BothAsOne(hinge));
}

TEST(UnlikeParts, AreNamedWhereTwoBonesHaveOneLabel) {
  const Hinge hinge;
  const BoneFit bent = NamedIn(hinge, hinge.truth);
  EXPECT_TRUE(bent.Doubtful());
  EXPECT_THAT(bent.note, testing::HasSubstr("two bones have one label"));
}

TEST(UnlikeParts, AreNotThereWhereAllMovesTogether) {
  const Hinge hinge;
  EXPECT_FALSE(NamedIn(hinge, {hinge.truth[0], hinge.truth[0]}).Doubtful());
}

// As at a joint: bright tissue lay beside the second ellipsoid, which the scan does not show there.
TEST(UnlikeParts, AreNotThereWhereOtherTissueLiesBesideTheBone) {
  const Hinge hinge;
  const Volume& image = hinge.world.template_scan->volume;
  BoneTissue tissue = BothAsOne(hinge);
  for (size_t v = 0; v < image.values.size(); ++v) {
    const Eigen::Vector3d at = image.grid.ToMm(PointVox{image.grid.Ijk(v).cast<double>()}).lps;
    const Eigen::Vector3d from_tip = at - kHinge[1].centre_mm;
    const bool beside = from_tip.cwiseQuotient((kHinge[1].half_mm.array() + 3).matrix()).norm() < 1;
    if (hinge.world.bones->labels.values[v] != 0 || !beside) continue;
    TissueSample sample{};
    sample.from_centre_mm = at, sample.away_mm = 1, sample.value = 200, sample.own_weight = 1;
    tissue.samples.push_back(sample);
  }
  EXPECT_FALSE(NamedIn(hinge, {hinge.truth[0], hinge.truth[0]}, tissue).Doubtful());
  EXPECT_TRUE(NamedIn(hinge, hinge.truth, tissue).Doubtful());
}

}  // namespace
}  // namespace kvx
