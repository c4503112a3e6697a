// What a lost bone hides: its own neighbourhood, and that of joints whose angles it decides.
#include "pipeline/examples/shown_tissue.h"

#include <gtest/gtest.h>

#include <random>

#include "pipeline/artifacts/held.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

constexpr int kBones = 4, kLength = 16;  // a chain along the first axis, so many voxels a bone

struct Chain {
  Chain() {
    grid = ObliqueGrid({kBones * kLength, 4, 4});
    body = Mask(grid, 1);
    weights = WeightMap(grid);
    registered.place_error_steps = Mask(grid, 2);
    registered.scan_from_template = DisplacementField(grid, Eigen::Vector3f::Zero());
    template_scan.volume = Volume(grid);
    std::mt19937 random(3);
    for (float& value : template_scan.volume.values) value = float(random() % 1000);
    scan = template_scan;
    for (int b = 0; b < kBones; ++b) {
      Joint joint{.child = b, .parent = b - 1};
      if (b > 0) joint.dofs.resize(1);
      fit.skeleton.joints.push_back(joint);
    }
    for (size_t v = 0; v < weights.values.size(); ++v) {
      const auto bone = uint8_t(grid.Ijk(v).x() / kLength);
      weights.values[v] = {{bone, bone, bone, bone}, {1, 0, 0, 0}};
    }
  }
  // The scan shows something else there.
  void Lose(int bone) {
    fits[size_t(bone)].doubt = Doubt::kBone;
    std::mt19937 random(5);
    for (size_t v = 0; v < scan.volume.values.size(); ++v) {
      if (weights.values[v].bones[0] == bone) scan.volume.values[v] = float(random() % 1000);
    }
  }
  void Find(int bone) {
    fits[size_t(bone)].doubt = Doubt::kNone;
    scan = template_scan;
  }
  // In the middle of every bone.
  std::vector<int> Shown() const {
    StageContext context{SharedBackend(), {}};
    const auto held_body = Held(body);
    const auto held_weights = Held(weights);
    const auto held_fits = Held(fits);
    const auto held_fit = Held(fit);
    const auto held_registered = Held(registered);
    const auto held_template = Held(template_scan);
    const auto held_scan = Held(scan);
    const Mask shown = ShownTissue::Run(
        {held_body, held_weights, held_fits, held_fit, held_registered, held_template, held_scan}, {},
        context);
    std::vector<int> out;
    for (int b = 0; b < kBones; ++b) out.push_back(shown(b * kLength + kLength / 2, 1, 1));
    return out;
  }
  Grid grid;
  Mask body;
  WeightMap weights;
  SkeletonFit fit;
  BoneFits fits = BoneFits(kBones);
  RegisteredScan registered;
  Scan template_scan, scan;
};

using Percents = std::vector<int>;

TEST(ShownTissue, IsAllOfTheBodyWhereNothingIsInDoubt) {
  Chain chain;
  EXPECT_EQ(chain.Shown(), Percents(kBones, 100));
  chain.body.values.assign(chain.body.values.size(), 0);
  EXPECT_EQ(chain.Shown(), Percents(kBones, 0)) << "outside the body";
}

TEST(ShownTissue, IsCarriedOnWhereItsPlaceIsNotKnown) {
  Chain chain;
  chain.registered.place_error_steps(kLength + kLength / 2, 1, 1) = kPlaceErrorUnknown;
  EXPECT_EQ(chain.Shown(), (Percents{100, kCarriedOnPercent, 100, 100}));
  chain.registered.place_error_steps(kLength + kLength / 2, 1, 1) = kPlaceErrorInDoubt;
  EXPECT_EQ(chain.Shown(), (Percents{100, kCarriedOnPercent, 100, 100}));
  chain.registered.place_error_steps = {};  // a method that states nothing
  EXPECT_EQ(chain.Shown(), Percents(kBones, 100));
}

TEST(ShownTissue, ADoubtfulBoneAmidImagesThatAgreeIsNotLost) {
  Chain chain;
  chain.fits[3].doubt = Doubt::kBone;
  EXPECT_EQ(chain.Shown(), Percents(kBones, 100));
  for (float& value : chain.scan.volume.values) value = 300 - 0.1f * value;
  EXPECT_EQ(chain.Shown()[3], 100) << "in other greys as much as beside the others";
  for (BoneFit& fit : chain.fits) fit.doubt = Doubt::kBone;
  EXPECT_EQ(chain.Shown(), Percents(kBones, 0)) << "no bone says how much they should agree";
}

// Half of the last bone was filled up: what the images do not say is no sign.
TEST(ShownTissue, ImagesCountWhereTheySayWhereTissueLies) {
  Chain chain;
  chain.Lose(3);
  for (size_t v = 0; v < chain.body.values.size(); ++v) {
    if (v % 2) chain.registered.place_error_steps.values[v] = kPlaceErrorUnknown;
    if (v % 2 == 0) chain.scan.volume.values[v] = chain.template_scan.volume.values[v];
  }
  EXPECT_EQ(chain.Shown(), Percents(kBones, 100));
}

TEST(ShownTissue, EndsBesideTheJointsThatALostBoneDecides) {
  Chain chain;
  chain.Lose(3);
  EXPECT_EQ(chain.Shown(), (Percents{100, 100, 0, 0})) << "the third bone's tissue bends with the fourth";
  chain.Find(3), chain.Lose(2);
  EXPECT_EQ(chain.Shown(), (Percents{100, 0, 0, 0}));
}

TEST(ShownTissue, ABoneThatOnlyFollowsDecidesNoAngles) {
  Chain chain;
  chain.fit.skeleton.joints[3].dofs.clear();
  chain.fit.skeleton.joints[3].drivers = {2};
  chain.Lose(3);
  EXPECT_EQ(chain.Shown(), (Percents{100, 100, 100, 0}));
  chain.Find(3), chain.Lose(1);
  EXPECT_EQ(chain.Shown(), Percents(kBones, 0)) << "but it goes where they lead: the second joint's too";
}

}  // namespace
}  // namespace kvx
