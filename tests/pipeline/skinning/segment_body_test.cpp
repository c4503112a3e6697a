// The body mask on drawn bodies with noise, a bias field, dark bones and narrow gaps.
#include <gtest/gtest.h>

#include <random>

#include "core/voxels/components.h"
#include "pipeline/skinning/segment_body.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

Mask BodyOf(const Volume& volume, const std::string& modality, const BoneSet& of) {
  StageContext context{SharedBackend(), {}};
  const Artifact<Scan> scan{{}, std::make_shared<Scan>(Scan{volume, ScalarType::kFloat32, modality})};
  const Artifact<BoneSet> bones{{}, std::make_shared<BoneSet>(of)};
  return SegmentBody::Run({scan, bones}, {}, context);
}

Mask BodyOf(const Volume& volume, const std::string& modality) {
  return BodyOf(volume, modality, {{}, LabelMap(volume.grid), {}});
}

double Dice(const Mask& a, const Mask& b) {
  size_t both = 0, sum = 0;
  for (size_t v = 0; v < a.values.size(); ++v)
    both += a.values[v] && b.values[v], sum += a.values[v] + b.values[v];
  return 2.0 * double(both) / double(sum);
}

Grid Even(const Eigen::Vector3i& size) { return ObliqueGrid(size); }

// A limb along k, cut by the border of the volume at both ends, with a dark bone inside.
struct Limb {
  Grid grid = Even({40, 36, 30});
  Mask truth{grid};
  Volume dark_bone{grid};  // 1 in the bone
  Limb() {
    for (size_t v = 0; v < truth.values.size(); ++v) {
      const Eigen::Vector3i p = grid.Ijk(v);
      const double r = std::hypot(p.x() - 20.0, p.y() - 18.0);
      truth.values[v] = r < 13;
      dark_bone.values[v] = r < 5 && r > 2;
    }
  }
};

TEST(SegmentBody, MagnitudeNoiseBiasAndDarkBones) {
  const Limb limb;
  for (const double snr : {8.0, 16.0}) {
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, 100 / snr);
    Volume mr(limb.grid);
    for (size_t v = 0; v < mr.values.size(); ++v) {
      const double bias = 0.6 + 0.8 * limb.grid.Ijk(v).z() / 29.0;
      const double signal = limb.truth.values[v] ? (limb.dark_bone.values[v] > 0 ? 5 : 100) * bias : 0;
      mr.values[v] = float(std::hypot(signal + noise(random), noise(random)));
    }
    EXPECT_GT(Dice(BodyOf(mr, "MR"), limb.truth), 0.97) << "signal to noise " << snr;
  }
}

// A shaft's marrow and the tissue around it, with cortex and a tendon on it that leave the scan with it: open
// at the border, where coils fade, they are no hole.
TEST(SegmentBody, CortexBesideATendonThatLeavesTheScanIsBody) {
  const Limb limb;
  Volume mr(limb.grid);
  BoneSet bones{{}, LabelMap(limb.grid), {}};
  LabelMap shifted(limb.grid);
  for (size_t v = 0; v < mr.values.size(); ++v) {
    const Eigen::Vector3i p = limb.grid.Ijk(v);
    const double r = std::hypot(p.x() - 20.0, p.y() - 18.0);
    const bool tendon = r >= 5 && r < 8 && p.x() > 20 && std::abs(p.y() - 18) < 4;
    const bool seen = p.z() > 0 && p.z() < 29 && !tendon && (r < 3 || r >= 5);
    mr.values[v] = limb.truth.values[v] && seen ? 100.0f : 0.0f;
    bones.labels.values[v] = r < 5 && p.z() > 0 && p.z() < 29;
    shifted.values[v] = std::hypot(p.x() - 33.0, p.y() - 18.0) < 5;
  }
  const Mask body = BodyOf(mr, "MR", bones);
  for (size_t v = 0; v < mr.values.size(); ++v)
    ASSERT_TRUE(body.values[v] || bones.labels.values[v] == 0) << limb.grid.Ijk(v).transpose();
  const Mask around_none = BodyOf(mr, "MR");
  EXPECT_FALSE(around_none(24, 18, 15)) << "nothing but a label tells that cortex";
  bones.labels = shifted;
  const Mask beside = BodyOf(mr, "MR", bones);
  EXPECT_FALSE(beside(36, 18, 15)) << "a label in the air makes no body";
}

TEST(SegmentBody, HounsfieldUnits) {
  const Limb limb;
  Volume ct(limb.grid, -1000.0f);
  for (size_t v = 0; v < ct.values.size(); ++v) {
    if (limb.truth.values[v]) ct.values[v] = limb.dark_bone.values[v] > 0 ? 900.0f : 30.0f;
  }
  EXPECT_GT(Dice(BodyOf(ct, "CT"), limb.truth), 0.97);
}

// A voxel in the corner reads a million; so does one beside the skin, which is near enough to be smoothed in.
TEST(SegmentBody, SingleVoxelsFarAboveAllOthersHideNoTissue) {
  const Limb limb;
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 8);
  Volume mr(limb.grid);
  for (size_t v = 0; v < mr.values.size(); ++v)
    mr.values[v] = float(std::hypot((limb.truth.values[v] ? 100 : 0) + noise(random), noise(random)));
  const Mask before = BodyOf(mr, "MR");
  EXPECT_GT(Dice(before, limb.truth), 0.97);
  mr(0, 0, 0) = mr(20, 3, 15) = 1e6f;
  EXPECT_GT(Dice(BodyOf(mr, "MR"), before), 0.995);
}

TEST(SegmentBody, MetalInACtHidesNoTissue) {
  const Limb limb;
  Volume ct(limb.grid, -1000.0f);
  for (size_t v = 0; v < ct.values.size(); ++v) {
    const Eigen::Vector3i p = limb.grid.Ijk(v);
    if (limb.truth.values[v]) ct.values[v] = 30;
    if (std::hypot(p.x() - 20.0, p.y() - 18.0) < 4) ct.values[v] = 20000;  // a nail, some 3 % of all
  }
  EXPECT_GT(Dice(BodyOf(ct, "CT"), limb.truth), 0.97);
}

TEST(SegmentBody, TheTableOfACtIsNoBody) {
  const Limb limb;
  Volume ct(limb.grid, -1000.0f);
  BoneSet bones{{Bone{.label = 1, .name = "tibia"}}, LabelMap(limb.grid), {}};
  Mask beside(limb.grid);
  for (size_t v = 0; v < ct.values.size(); ++v) {
    const Eigen::Vector3i p = limb.grid.Ijk(v);
    const bool table = p.y() == 31 || p.y() == 32;  // what lies on it touches it
    bones.labels.values[v] = limb.dark_bone.values[v] > 0;
    if (table) ct.values[v] = -200;
    if (limb.truth.values[v]) ct.values[v] = bones.labels.values[v] ? 900.0f : 30.0f;
    beside.values[v] = table && std::abs(p.x() - 20) > 12;
  }
  const Mask body = BodyOf(ct, "CT", bones);
  EXPECT_GT(Dice(body, limb.truth), 0.96);  // with the table where it touches
  EXPECT_EQ(Dice(body, beside), 0);
}

TEST(SegmentBody, AScanWithoutAirIsAllBody) {
  Volume inside(Even({20, 20, 20}), 40.0f);
  for (size_t v = 0; v < inside.values.size(); v += 3) inside.values[v] = 60.0f;
  const Mask body = BodyOf(inside, "MR");
  EXPECT_EQ(std::count(body.values.begin(), body.values.end(), 1), std::ptrdiff_t(body.values.size()));
}

TEST(SegmentBody, AGapOfOneVoxelBetweenFingersStaysOpen) {
  const Grid grid = Even({30, 40, 24});
  Volume mr(grid);
  for (size_t v = 0; v < mr.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v);
    const bool finger = p.x() >= 5 && p.x() <= 24 && p.x() != 15 && p.z() >= 8 && p.z() <= 15;
    const bool palm = p.y() < 12;  // joins the fingers
    const bool tips = p.y() > 32;  // the fingertips touch: the gap is closed in every slice across z
    if ((finger || (palm && p.x() == 15) || (tips && p.x() == 15)) && p.z() >= 8 && p.z() <= 15)
      mr.values[v] = 100;
  }
  const Mask body = BodyOf(mr, "MR");
  for (int j = 14; j <= 30; ++j) {
    for (int k = 0; k < 24; ++k) ASSERT_EQ(body(15, j, k), 0) << j << " " << k;
  }
  EXPECT_EQ(body(14, 20, 11), 1);
  EXPECT_EQ(body(15, 5, 11), 1);
}

TEST(FillHoles, ClosesCavitiesAndBonesCutByTheBorderOnly) {
  const Limb limb;
  Mask hollow = limb.truth;
  for (size_t v = 0; v < hollow.values.size(); ++v)
    hollow.values[v] = hollow.values[v] && !limb.dark_bone.values[v];
  EXPECT_EQ(FillHoles(hollow).values, limb.truth.values);
  Mask open = limb.truth;
  for (int i = 0; i <= 20; ++i) open(i, 18, 15) = 0;  // a channel from the air to the axis
  EXPECT_EQ(FillHoles(open).values, open.values);
}

}  // namespace
}  // namespace kvx
