// Stated errors of a body of one bone whose covariance is known.
#include "pipeline/registration/result/confidence.h"

#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/artifacts/held.h"

namespace kvx {
namespace {

constexpr double kStatedDeviations = 1.2;  // two of three errors are within so many

// A cube of 8 mm in a grid of 48 mm, all of one bone that may turn about z by 0.1 radians either way.
struct OneBone {
  explicit OneBone(const Eigen::Vector3d& origin_mm) : grid(CubeAt(origin_mm)) {
    for (int k = 10; k < 14; ++k) {
      for (int j = 10; j < 14; ++j) {
        for (int i = 10; i < 14; ++i) body(i, j, k) = 1;
      }
    }
    bones.bones = {{.label = 1, .name = "rod", .centroid = grid.ToMm(10, 10, 10)}};
    bones.labels = LabelMap(grid);
    fits[0].covariance(2, 2) = 0.1 * 0.1;
  }
  // `free`: soft tissue far from bone, which the images leave nothing open of, or of which they show nothing.
  // `disagreement`: of the images in the middle of the body, and elsewhere; 1 is what well registered tissue
  // has.
  Mask Steps(bool free, const Eigen::Vector3d& moved_mm = {0, 0, 0}, float disagreement = 1,
             float elsewhere = 1) const {
    const WorkRegion region = RegionAround(body);
    LeftOpen nothing_open = NothingOpen(region, elsewhere);
    const Eigen::Vector3i middle = (Eigen::Vector3i(12, 12, 12) - region.first) / 2;
    nothing_open.disagreement(middle.x(), middle.y(), middle.z()) = disagreement;
    return Steps(region, Volume(region.grid, free ? 1e3f : 0.0f), nothing_open,
                 [&](const PointMm& x) -> Eigen::Vector3d { return x.lps + moved_mm; });
  }
  // The images agree and leave nothing open.
  template <class Motion>
  Mask Steps(const Volume& beyond_coat_mm, const Motion& motion) const {
    const WorkRegion region = RegionAround(body);
    return Steps(region, beyond_coat_mm, NothingOpen(region, 1), motion);
  }

  Grid grid;
  Mask body{grid};
  BoneSet bones;
  BoneFits fits{1};
  std::string template_modality, scan_modality;
  bool images_show = true;  // where tissue lies

 private:
  LeftOpen NothingOpen(const WorkRegion& region, float disagreement) const {
    const Grid cells = Coarsened(region.grid, 2);
    SharedSlopes known;
    known.products = 1e9 * Eigen::Matrix3d::Identity(), known.weight = images_show ? 1 : 0;
    return {std::vector<float>(cells.VoxelCount(), 0.0f), Volume(cells, disagreement),
            Image<SharedSlopes>(Coarsened(region.grid, kBlockVoxels), known)};
  }
  template <class Motion>
  Mask Steps(const WorkRegion& region, const Volume& beyond_coat_mm, const LeftOpen& left_open,
             const Motion& motion) const {
    std::vector<Eigen::Vector3f> scan_mm(region.grid.VoxelCount());
    for (size_t v = 0; v < scan_mm.size(); ++v)
      scan_mm[v] =
          motion(region.grid.ToMm(PointVox{region.grid.Ijk(v).cast<double>()})).template cast<float>();
    VoxelWeights rigid;
    rigid.weights[0] = 1;
    const auto template_image = Held(ImageOf(template_modality)), image = Held(ImageOf(scan_modality));
    const auto mask = Held(body);
    const auto set = Held(bones);
    const auto weights = Held(WeightMap(grid, rigid));
    const auto poses = Held(fits);
    const LevelImages images{.beyond_coat_mm = beyond_coat_mm, .body = Crop(body, region), .scan_grid = grid};
    return PlaceErrorSteps({template_image, mask, set, weights, poses, image}, images, region, left_open,
                           scan_mm);
  }
  Scan ImageOf(const std::string& modality) const {
    Scan out;
    out.volume = Volume(grid);
    out.modality = modality;
    return out;
  }
  static Grid CubeAt(const Eigen::Vector3d& origin_mm) {
    Grid cube;
    cube.size = {24, 24, 24};
    cube.spacing_mm = {2, 2, 2};
    cube.origin.lps = origin_mm;
    return cube;
  }
};

TEST(PlaceErrorSteps, InBoneAreThoseOfItsTurnAboutItsCentroid) {
  const Mask steps = OneBone({0, 0, 0}).Steps(false);
  EXPECT_EQ(steps(10, 10, 10), 0);
  EXPECT_EQ(steps(10, 10, 13), 0) << "on the axis";
  // 6 mm from the axis: 0.6 mm, 1.2 times, in steps of 0.05 mm
  EXPECT_NEAR(steps(13, 10, 10), kStatedDeviations * 0.1 * 6 / kPlaceErrorStepMm, 1);
  EXPECT_EQ(steps(0, 0, 0), kPlaceErrorUnknown) << "outside the body";
}

TEST(PlaceErrorSteps, DoNotDependOnWhereTheScannersOriginLies) {
  EXPECT_EQ(OneBone({300, -300, 300}).Steps(false).values, OneBone({0, 0, 0}).Steps(false).values);
}

TEST(PlaceErrorSteps, OfADoubtfulBoneSaySoAndNothingElse) {
  OneBone bone({0, 0, 0});
  bone.fits[0].doubt = Doubt::kBone;
  bone.fits[0].covariance.setIdentity();  // of a bone out of view: more than the steps can say
  bone.fits[0].covariance *= 1e4;
  for (const bool free : {false, true}) {
    const Mask steps = bone.Steps(free);
    const Volume error_mm = PlaceErrorMm(steps);
    const Mask percent = ConfidencePercent(steps);
    for (size_t v = 0; v < steps.values.size(); ++v) {
      EXPECT_EQ(steps.values[v], bone.body.values[v] ? kPlaceErrorInDoubt : kPlaceErrorUnknown);
      EXPECT_TRUE(std::isnan(error_mm.values[v]));
      EXPECT_EQ(percent.values[v], 0);
    }
  }
}

// Where the images leave nothing open, what is left is 7 per cent of the way from where the bone alone puts
// it.
TEST(PlaceErrorSteps, OfSoftTissueGrowWithTheWayFromTheBonesMotion) {
  const OneBone bone({0, 0, 0});
  EXPECT_EQ(bone.Steps(true)(12, 12, 12), 0);
  for (const double way_mm : {10.0, 20.0}) {
    const Mask steps = bone.Steps(true, {0.6 * way_mm, 0, 0.8 * way_mm});
    EXPECT_NEAR(steps(12, 12, 12), kStatedDeviations * 0.07 * way_mm / kPlaceErrorStepMm, 1) << way_mm;
  }
}

// Four times the variance where images disagree twelve times as much as usual, which is four times what is
// borne; bones are known by their own evidence.
TEST(PlaceErrorSteps, OfSoftTissueGrowWhereTheImagesDisagree) {
  const OneBone bone({0, 0, 0});
  const Eigen::Vector3d moved_mm(0, 0, 20);
  const double stated_mm = kStatedDeviations * 0.07 * 20;
  EXPECT_NEAR(bone.Steps(true, moved_mm, 3)(12, 12, 12), stated_mm / kPlaceErrorStepMm, 1) << "borne";
  EXPECT_NEAR(bone.Steps(true, moved_mm, 12)(12, 12, 12), 2 * stated_mm / kPlaceErrorStepMm, 1);
  EXPECT_NEAR(bone.Steps(true, moved_mm, 12, 12)(12, 12, 12), stated_mm / kPlaceErrorStepMm, 1)
      << "all alike";
  EXPECT_EQ(bone.Steps(false, {0, 0, 0}, 12).values, bone.Steps(false).values);
}

// A fixed part of how far tissue moves in this scan is added to the part of the way that counts in any case,
// both as squares; bones are known by their own evidence.
TEST(PlaceErrorSteps, OfSoftTissueGrowWhereTheImagesShowNothing) {
  OneBone bone({0, 0, 0});
  bone.images_show = false;
  const Mask steps = bone.Steps(true, {0, 0, 10});
  EXPECT_NEAR(steps(12, 12, 12), kStatedDeviations * 10 * std::sqrt(0.3 + 0.07 * 0.07) / kPlaceErrorStepMm,
              1);
  EXPECT_EQ(bone.Steps(false).values, OneBone({0, 0, 0}).Steps(false).values);
}

// 1.7 times; bones are known by their own evidence.
TEST(PlaceErrorSteps, OfSoftTissueGrowBetweenCtAndMr) {
  OneBone bone({0, 0, 0});
  const Eigen::Vector3d moved_mm(0, 0, 20);
  const Mask tissue = bone.Steps(true, moved_mm), rigid = bone.Steps(false);
  bone.template_modality = "CT";
  EXPECT_NEAR(bone.Steps(true, moved_mm)(12, 12, 12), 1.7 * kStatedDeviations * 0.07 * 20 / kPlaceErrorStepMm,
              1);
  EXPECT_EQ(bone.Steps(false).values, rigid.values);
  bone.scan_modality = "CT";
  EXPECT_EQ(bone.Steps(true, moved_mm).values, tissue.values) << "both";
  bone.template_modality = "MR";
  EXPECT_NEAR(bone.Steps(true, moved_mm)(12, 12, 12), 1.7 * kStatedDeviations * 0.07 * 20 / kPlaceErrorStepMm,
              1);
}

// A rod along z turns by half a radian. In its coat, 6 mm thick, tissue is as far off as a part of the way
// that it slips just beyond, where it is free (10 mm from the axis); in the rod itself the rod is known.
TEST(PlaceErrorSteps, InTheCoatOfABoneAreAPartOfHowFarTissueSlipsBesideIt) {
  OneBone rod({0, 0, 0});
  rod.fits[0] = BoneFit();
  rod.body = Mask(rod.grid, 1);
  for (int k = 0; k < 24; ++k) rod.bones.labels(12, 12, k) = 1;
  rod.fits[0].scan_from_template = RotationAbout(rod.grid.ToMm(12, 12, 12), {0, 0, 1}, 0.5);
  const WorkRegion region = RegionAround(rod.body);
  Volume beyond_coat_mm(region.grid);
  for (size_t v = 0; v < beyond_coat_mm.values.size(); ++v) {
    const Eigen::Vector3i p = region.grid.Ijk(v) + region.first;
    beyond_coat_mm.values[v] = float(2 * std::hypot(p.x() - 12, p.y() - 12) - 6);
  }
  const Mask along = rod.Steps(beyond_coat_mm, [&](const PointMm& x) -> Eigen::Vector3d {
    return (rod.fits[0].scan_from_template * x).lps;
  });
  const Mask slipping = rod.Steps(beyond_coat_mm, [](const PointMm& x) -> Eigen::Vector3d { return x.lps; });
  const double slip_mm = 2 * 10 * std::sin(0.25);
  for (const int i : {13, 14, 15}) {
    EXPECT_LE(along(i, 12, 12), 1) << i << ": rounding";
    EXPECT_NEAR(slipping(i, 12, 12), 0.18 * slip_mm / kPlaceErrorStepMm, 1) << i;
  }
  EXPECT_EQ(slipping(12, 12, 12), 0);
}

// Two blocks of bone with four voxels of tissue between them, one of which stands still.
TEST(PlaceErrorSteps, BetweenBonesThatDrawApartAreAPartOfTheirWay) {
  OneBone blocks({0, 0, 0});
  blocks.fits.assign(2, BoneFit());
  blocks.bones.bones.push_back({.label = 2, .name = "other"});
  for (int k = 6; k < 18; ++k) {
    for (int j = 6; j < 18; ++j) {
      for (int i = 6; i < 10; ++i) blocks.bones.labels(i, j, k) = 1, blocks.bones.labels(i + 8, j, k) = 2;
    }
  }
  EXPECT_EQ(blocks.Steps(false)(12, 12, 12), 0) << "together";
  blocks.fits[1].scan_from_template.translation_mm = {0, 0, 20};
  const Mask steps = blocks.Steps(false);
  for (const int i : {10, 11, 12, 13}) {
    const double farther_mm = 2 * std::max(i - 9.5, 13.5 - i), reach_mm = 4.1 * std::sqrt(2.0);
    const double least = 0.33 * 20 * std::exp(-(farther_mm + 2) / reach_mm),
                 most = 0.33 * 20 * std::exp(-(farther_mm - 2) / reach_mm);  // a voxel more or less
    EXPECT_GT(kPlaceErrorStepMm * steps(i, 12, 12), least) << i;
    EXPECT_LT(kPlaceErrorStepMm * steps(i, 12, 12), most) << i;
  }
}

}  // namespace
}  // namespace kvx
