// Host loops over the body.
#include "pipeline/registration/result/confidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"
#include "core/voxels/nearest_voxel.h"
#include "core/voxels/sample_clamped.h"
#include "core/voxels/voxel_box.h"
#include "pipeline/registration/region/blend_table.h"
#include "pipeline/registration/result/carried_place.h"
#include "pipeline/registration/result/nearest_bones.h"
#include "pipeline/scans/grey_kind.h"
#include "pipeline/skeleton/bone_certainty.h"

namespace kvx {
namespace {

// Beside what the images leave open, tissue is the less sure the farther it is from where the bones alone
// would put it: what the prior and the linear images do not know grows with the way.
constexpr double kErrorPerMoved = 0.07;
// Between bones that move against each other cartilage slides and fat folds, which images in which nothing
// stands out and a prior do not know. Two of three errors there are within this part of how far the bones
// draw apart at the place; it fades with the distance from the farther bone. Read from the same phantoms:
// "How sure", by distance from joints.
constexpr double kErrorPerApart = 0.33,
                 kApartReach = 4.1;  // the latter times the root of the voxel, both in mm

// A bone's coat goes with the bone, whether or not it does in the patient. Where tissue just beyond it slips,
// two of three errors in the coat are within this part of the slip. Read from seven phantoms: "How sure", by
// distance from bone.
constexpr double kErrorPerSlip = 0.18;

// Where registered images disagree by more than so many times what well registered tissue does, neither the
// images nor the prior tell how far off it is: one of the two lacks what the other shows, or tissue went to
// where it does not belong. There variances are the greater the more the images disagree. Read from the given
// phantoms, with and without new tissue in the scan. What all of the scan has, as where an artefact lies over
// it, is in the variances already; so it must be more than so many times the scan's median, too.
constexpr double kDisagree = 3, kDisagreeOfMedian = 1.5;

// Between a CT and an MR, errors of soft tissue are so many times what images and prior leave open, wherever
// they are and however far tissue went: each shows borders that the other does not. Other MR contrasts need
// no such factor: "How sure", across modalities.
constexpr double kAcrossModalities = 1.7;

// Two of three errors are within so many standard deviations (root of the covariance's trace). For normal
// errors it would be 1.1. Read from phantoms of two generators: docs/results.md, "How sure". It is more than
// most need.
constexpr double kDeviations = 1.2;

// How likely it is that an error is below x times the stated one: 1 - exp(-kSteepness x^kShape). Such that of
// each of eleven phantoms without added noise what has 40 per cent and more is right as often as that.
constexpr double kSteepness = 1.2, kShape = 1.3;
constexpr double kRightVoxels = 0.5;

uint8_t Steps(double error_mm) {
  const double steps = std::ceil(error_mm / kPlaceErrorStepMm);
  return steps < kPlaceErrorInDoubt ? uint8_t(steps) : kPlaceErrorUnknown;  // also where it is not a number
}

bool Known(uint8_t steps) { return steps < kPlaceErrorInDoubt; }

// Of soft tissue, in mm: what two bones that draw apart beside it leave open.
class BetweenBones {
 public:
  BetweenBones(const BoneSet& bones, const WorkRegion& region, const PoseVector& scan_from_template)
      : reach_mm_(kApartReach * std::sqrt(region.grid.MeanSpacingMm())),
        nearest_(NearestBonesAt(bones, region, kFarthest * reach_mm_)),
        scan_from_template_(scan_from_template) {}

  double operator()(const Eigen::Vector3i& cell, const PointMm& x) const {
    const NearestBones& near = nearest_(cell.x(), cell.y(), cell.z());
    if (near.second == kNoParent) return 0;
    const Eigen::Vector3d apart = (scan_from_template_[size_t(near.first)] * x).lps -
                                  (scan_from_template_[size_t(near.second)] * x).lps;
    const double beyond_mm = std::max(0.0, double(near.second_mm));
    return kErrorPerApart / kDeviations * std::exp(-beyond_mm / reach_mm_) * apart.norm();
  }

 private:
  static constexpr double kFarthest = 4;  // reaches
  double reach_mm_;
  Image<NearestBones> nearest_;
  const PoseVector& scan_from_template_;
};

// How far tissue slips along bones, in mm.
class SlipBesideCoats {
 public:
  SlipBesideCoats(const LevelImages& images, const WorkRegion& region,
                  const std::vector<Eigen::Vector3f>& scan_mm)
      : region_(region), scan_mm_(scan_mm) {
    const double voxel_mm = region.grid.spacing_mm.maxCoeff();
    Mask free(region.grid);
    for (size_t v = 0; v < free.values.size(); ++v)
      free.values[v] =
          images.body.values[v] && FreedomBesideBone(images.beyond_coat_mm.values[v], voxel_mm) >= 1;
    if (std::ranges::find(free.values, 1) != free.values.end()) nearest_free_ = NearestMarked(free);
  }
  // Of what moves as the images say nearest to a voxel of the region, along a bone that moves so.
  double operator()(size_t voxel, const RigidTransform& scan_from_template) const {
    if (nearest_free_.empty()) return 0;
    const size_t free = nearest_free_[voxel];
    const PointMm x = region_.grid.ToMm(PointVox{region_.grid.Ijk(free).cast<double>()});
    return (scan_mm_[free].cast<double>() - (scan_from_template * x).lps).norm();
  }

 private:
  const WorkRegion& region_;
  const std::vector<Eigen::Vector3f>& scan_mm_;
  std::vector<uint32_t> nearest_free_;
};

// How far tissue lies from where the bones alone would put it, mm; not a number outside the body.
class WayFromSkinned {
 public:
  WayFromSkinned(const RegistrationInputs& inputs, const WorkRegion& region, const PoseVector& pose,
                 const std::vector<Eigen::Vector3f>& scan_mm)
      : body_(*inputs.body), weights_(*inputs.weights), skinned_(pose), region_(region), scan_mm_(scan_mm) {}

  // Of a voxel of the region.
  Eigen::Vector3d operator()(const Eigen::Vector3i& voxel) const {
    const Eigen::Vector3i at = voxel + region_.first;
    if (!body_.grid.Contains(at) || !body_(at.x(), at.y(), at.z()))
      return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    const Eigen::Vector3d x = body_.grid.ToMm(PointVox{at.cast<double>()}).lps;
    return scan_mm_[region_.grid.Index(voxel.x(), voxel.y(), voxel.z())].cast<double>() -
           Apply(skinned_(weights_(at.x(), at.y(), at.z())), x);
  }
  // On average over every other voxel of the block.
  Image<Eigen::Vector3f> OfBlocks(const Grid& blocks) const {
    Image<Eigen::Vector3f> out(blocks);
    ParallelEach(out.values.size(), [&](size_t b) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      double count = 0;
      const VoxelBox halved{Eigen::Vector3i::Zero(), Eigen::Vector3i::Constant(kBlockVoxels / 2)};
      ForEachVoxel(halved, [&](const Eigen::Vector3i& voxel) {
        const Eigen::Vector3i at = kBlockVoxels * blocks.Ijk(b) + 2 * voxel;
        if (!region_.grid.Contains(at)) return;
        const Eigen::Vector3d way_mm = (*this)(at);
        if (way_mm.allFinite()) sum += way_mm, count += 1;
      });
      out.values[b] = (sum / count).cast<float>();  // not a number without any
    });
    return out;
  }

 private:
  const Mask& body_;
  const WeightMap& weights_;
  BlendTable skinned_;
  const WorkRegion& region_;
  const std::vector<Eigen::Vector3f>& scan_mm_;
};

// By how much variances are greater because the images disagree; at least 1.
class ImageDoubt {
 public:
  explicit ImageDoubt(const Volume& disagreement) : disagreement_(disagreement) {
    std::vector<float> seen;
    for (const float value : disagreement.values)
      if (value > 0) seen.push_back(value);
    if (!seen.empty()) borne_ = std::max(kDisagree, kDisagreeOfMedian * double(TakeMedian(seen)));
  }
  double operator()(const Eigen::Vector3i& cell) const {
    return std::max(1.0, disagreement_(cell.x(), cell.y(), cell.z()) / borne_);
  }

 private:
  const Volume& disagreement_;
  double borne_ = kDisagree;
};

// Of variances.
double TimesAcrossModalities(const RegistrationInputs& inputs) {
  const auto hounsfield = [](const Scan& scan) { return IsHounsfield(scan.volume, scan.modality); };
  return hounsfield(*inputs.template_scan) == hounsfield(*inputs.scan)
             ? 1.0
             : kAcrossModalities * kAcrossModalities;
}

}  // namespace

Mask PlaceErrorSteps(const RegistrationInputs& inputs, const LevelImages& images, const WorkRegion& region,
                     const LeftOpen& left_open, const std::vector<Eigen::Vector3f>& scan_mm) {
  const Mask& body = *inputs.body;
  const Grid& cells = left_open.disagreement.grid;
  const double voxel_mm = region.grid.spacing_mm.maxCoeff();
  const PoseVector pose = PoseOf(*inputs.fits);
  const WayFromSkinned way(inputs, region, pose, scan_mm);
  const Volume carried_mm2 = CarriedVariancesMm2(left_open.slopes, way.OfBlocks(left_open.slopes.grid));
  const BetweenBones between(*inputs.bones, region, pose);
  const SlipBesideCoats slip(images, region, scan_mm);
  const ImageDoubt doubt(left_open.disagreement);
  const double across = TimesAcrossModalities(inputs);
  Mask out(body.grid, kPlaceErrorUnknown);
  ParallelEach(body.values.size(), [&](size_t v) {
    if (!body.values[v]) return;
    const Eigen::Vector3i p = body.grid.Ijk(v) - region.first, c = p / 2;
    const size_t at = region.grid.Index(p.x(), p.y(), p.z());
    if (!ScanShows(images, PointMm{scan_mm[at].cast<double>()})) return;
    const size_t b = inputs.weights->values[v].bones[0];  // the largest weight is the first
    const BoneFit& bone = (*inputs.fits)[b];
    const Eigen::Vector3d x = body.grid.ToMm(PointVox{body.grid.Ijk(v).cast<double>()}).lps;
    const double way_mm = kErrorPerMoved * way(p).norm();
    const bool soft = !inputs.bones->labels.values[v];
    const double between_mm = soft ? between(c, PointMm{x}) : 0;
    const double free = FreedomBesideBone(images.beyond_coat_mm.values[at], voxel_mm);
    const double of_images = left_open.variances_mm2[cells.Index(c.x(), c.y(), c.z())] +
                             SampleClamped(carried_mm2, carried_mm2.grid.ToVox(PointMm{x}));
    const double slip_mm = soft && free < 1 ? kErrorPerSlip / kDeviations * slip(at, pose[b]) : 0;
    const double of_tissue = (free > 0 ? free * (of_images + way_mm * way_mm) : 0) +
                             (1 - free) * slip_mm * slip_mm + between_mm * between_mm;
    const double of_bone =
        bone.Doubtful() ? 0 : PlaceVarianceMm2(bone, x - inputs.bones->bones[b].centroid.lps);
    const uint8_t steps =
        Steps(kDeviations * std::sqrt(across * doubt(c) * of_tissue + (1 - free) * of_bone));
    out.values[v] = Known(steps) && bone.Doubtful() ? kPlaceErrorInDoubt : steps;
  });
  return out;
}

Volume PlaceErrorMm(const Mask& place_error_steps) {
  Volume out(place_error_steps.grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    const uint8_t steps = place_error_steps.values[v];
    out.values[v] = Known(steps) ? float(kPlaceErrorStepMm * steps) : std::numeric_limits<float>::quiet_NaN();
  }
  return out;
}

Mask ConfidencePercent(const Mask& place_error_steps) {
  Mask out(place_error_steps.grid);
  const double right_mm = kRightVoxels * out.grid.MeanSpacingMm();
  std::array<uint8_t, 256> percent{};
  for (int steps = 0; Known(uint8_t(steps)); ++steps) {
    const double times = right_mm / (kPlaceErrorStepMm * std::max(steps, 1));
    percent[size_t(steps)] = uint8_t(std::lround(-100 * std::expm1(-kSteepness * std::pow(times, kShape))));
  }
  for (size_t v = 0; v < out.values.size(); ++v) out.values[v] = percent[place_error_steps.values[v]];
  return out;
}

ConfidenceSummary Summarise(const Mask& place_error_steps, const Mask& body) {
  const Mask percent = ConfidencePercent(place_error_steps);
  double sum = 0, unsure = 0, count = 0;
  for (size_t v = 0; v < body.values.size(); ++v) {
    if (!body.values[v]) continue;
    count += 1, sum += percent.values[v], unsure += percent.values[v] < kUnsurePercent;
  }
  if (count < 1) return {};
  return {sum / count, unsure / count};
}

}  // namespace kvx
