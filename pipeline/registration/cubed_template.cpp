// Host loops over the finer grid.
#include "pipeline/registration/cubed_template.h"

#include "core/bone_of_label.h"
#include "core/host/parallel.h"
#include "core/voxel_weights.h"
#include "core/voxels/distance_map.h"
#include "core/voxels/finer_grid.h"
#include "pipeline/artifacts/held.h"
#include "pipeline/registration/region/level_field.h"
#include "pipeline/registration/result/confidence.h"
#include "pipeline/registration/tissue/fold_repair.h"
#include "pipeline/scans/finer_scan.h"
#include "pipeline/scans/measured_box.h"

namespace kvx {
namespace {

bool AtAVoxel(const Eigen::Vector3i& finer, const Eigen::Vector3i& times) {
  return (finer - (finer.array() / times.array() * times.array()).matrix()).isZero();
}

std::vector<uint16_t> LabelsOf(const LabelMap& map) {
  std::vector<char> there(65536, 0);
  for (const uint16_t label : map.values) there[label] = 1;
  std::vector<uint16_t> labels;
  for (int label = 1; label < 65536; ++label)
    if (there[label]) labels.push_back(uint16_t(label));
  return labels;
}

// Gives `label` to the finer voxels, between the map's, that lie deeper in it than in those before.
void DrawBetween(const LabelMap& labels, uint16_t label, const Eigen::Vector3i& times, Volume& depth_mm,
                 LabelMap& finer) {
  const Volume distance_mm = SignedDistance(labels, label, labels.grid.spacing_mm.maxCoeff());
  const Eigen::Vector3d first = labels.grid.ToVox(distance_mm.grid.origin).ijk;
  const Eigen::Vector3d low = first.cwiseMax(0).cwiseProduct(times.cast<double>());
  const Eigen::Vector3d high =
      (first + distance_mm.grid.size.cast<double>()).cwiseProduct(times.cast<double>());
  const Eigen::Vector3i from = low.array().round().cast<int>();
  const Eigen::Vector3i to = high.array().round().cast<int>().min(finer.grid.size.array());
  ParallelEach(size_t(std::max(0, to.z() - from.z())), [&](size_t plane) {
    const int k = from.z() + int(plane);
    for (int j = from.y(); j < to.y(); ++j) {
      for (int i = from.x(); i < to.x(); ++i) {
        const Eigen::Vector3i p(i, j, k);
        if (AtAVoxel(p, times)) continue;
        const Eigen::Vector3d at = p.cast<double>().cwiseQuotient(times.cast<double>()) - first;
        const float depth = -SampleTrilinear(distance_mm, PointVox{at}, 1);
        const size_t v = finer.grid.Index(i, j, k);
        if (depth > depth_mm.values[v]) depth_mm.values[v] = depth, finer.values[v] = label;
      }
    }
  });
}

Mask FinerMask(const Mask& mask, const Eigen::Vector3i& times) {
  LabelMap one(mask.grid);
  std::copy(mask.values.begin(), mask.values.end(), one.values.begin());
  const LabelMap finer = FinerLabels(one, times);
  Mask out(finer.grid);
  std::copy(finer.values.begin(), finer.values.end(), out.values.begin());
  return out;
}

VoxelWeights Between(const WeightMap& weights, const Eigen::Vector3d& p) {
  std::array<std::pair<uint8_t, float>, 8 * kBonesPerVoxel> sums;
  size_t count = 0;
  const Eigen::Vector3i lo = p.cast<int>();
  const Eigen::Vector3f f = (p - lo.cast<double>()).cast<float>();
  for (int c = 0; c < 8; ++c) {
    const float share =
        (c & 1 ? f.x() : 1 - f.x()) * (c & 2 ? f.y() : 1 - f.y()) * (c & 4 ? f.z() : 1 - f.z());
    if (share <= 0) continue;
    const VoxelWeights& corner = weights(lo.x() + (c & 1), lo.y() + (c >> 1 & 1), lo.z() + (c >> 2));
    for (int s = 0; s < kBonesPerVoxel; ++s) {
      if (corner.weights[s] <= 0) continue;
      size_t n = 0;
      while (n < count && sums[n].first != corner.bones[s]) ++n;
      if (n == count) sums[count++] = {corner.bones[s], 0.0f};
      sums[n].second += share * corner.weights[s];
    }
  }
  VoxelWeights out;
  for (size_t n = 0; n < count; ++n) Insert(out, sums[n].first, sums[n].second);
  Normalise(out);
  return out;
}

// Bone moves with its bone alone, also where its outline was drawn between voxels.
void MakeBonesRigid(const BoneSet& bones, WeightMap& weights) {
  const std::vector<int> bone_of_label = BoneOfLabel(bones.bones);
  for (size_t v = 0; v < weights.values.size(); ++v) {
    const int b = bone_of_label[bones.labels.values[v]];
    if (b != kNoBone) weights.values[v] = Rigid(uint8_t(b));
  }
}

// A spline through what a program filled up would swing on the measured side of the edge.
Volume FinerByWhatWasMeasured(const Volume& scan, const Eigen::Vector3i& times) {
  Volume out = Finer(scan, times).Taken();
  const VoxelBox box = MeasuredBoxOf(scan);
  if (box.size() == scan.grid.size) return out;
  const Volume measured = Finer(Cropped(scan, box), times).Taken();
  const Eigen::Vector3i low = box.low.cwiseProduct(times);
  ForEachVoxel({low, low + measured.grid.size}, out.grid,
               [&](const auto&, size_t part, size_t whole) { out.values[whole] = measured.values[part]; });
  return out;
}

DisplacementField Unfolded(const DisplacementField& scan_from_template, const RegistrationInputs& given,
                           const Progress& progress) {
  const WorkRegion region = RegionAround(*given.body);
  std::vector<Eigen::Vector3f> scan_mm(region.grid.VoxelCount());
  ParallelEach(scan_mm.size(), [&](size_t v) {
    const PointVox p{(region.grid.Ijk(v) + region.first).cast<double>()};
    scan_mm[v] = (scan_from_template.grid.ToMm(p).lps + SampleTrilinear(scan_from_template, p)).cast<float>();
  });
  Unfold(given.bones->labels, *given.body, region, progress, scan_mm);
  return OnTemplate(*given.weights, PoseOf(*given.fits), region, scan_mm);
}

}  // namespace

CubedTemplate::CubedTemplate(const RegistrationInputs& given, const Eigen::Vector3i& times) : given_(given) {
  Scan scan = *given.template_scan;
  scan.volume = FinerByWhatWasMeasured(scan.volume, times);
  template_scan_ = Held(std::move(scan));
  body_ = Held(FinerMask(*given.body, times));
  BoneSet bones{given.bones->bones, FinerLabels(given.bones->labels, times)};
  WeightMap weights = FinerWeights(*given.weights, times);
  MakeBonesRigid(bones, weights);
  bones_ = Held(std::move(bones));
  weights_ = Held(std::move(weights));
}

RegistrationInputs CubedTemplate::Inputs() const {
  return {template_scan_, body_, bones_, weights_, given_.fits, given_.scan};
}

LabelMap FinerLabels(const LabelMap& labels, const Eigen::Vector3i& times) {
  LabelMap finer(FinerGrid(labels.grid, times));
  for (size_t v = 0; v < labels.values.size(); ++v) {
    const Eigen::Vector3i p = labels.grid.Ijk(v).cwiseProduct(times);
    finer(p.x(), p.y(), p.z()) = labels.values[v];
  }
  Volume depth_mm(finer.grid);
  for (const uint16_t label : LabelsOf(labels)) DrawBetween(labels, label, times, depth_mm, finer);
  return finer;
}

WeightMap FinerWeights(const WeightMap& weights, const Eigen::Vector3i& times) {
  WeightMap finer(FinerGrid(weights.grid, times));
  ParallelEach(finer.values.size(), [&](size_t v) {
    const Eigen::Vector3d p = finer.grid.Ijk(v).cast<double>().cwiseQuotient(times.cast<double>());
    finer.values[v] = Between(weights, p);
  });
  return finer;
}

RegisteredScan AtTemplateVoxels(const RegisteredScan& finer, const RegistrationInputs& given,
                                const Eigen::Vector3i& times, const Progress& progress) {
  const Mask& body = *given.body;
  RegisteredScan out;
  out.control_points = finer.control_points;
  out.control_points_per_level = finer.control_points_per_level;
  out.scan_from_template = Unfolded(EveryVoxelOf(finer.scan_from_template, times).Taken(), given, progress);
  out.folded_fraction = FoldedFraction(out.scan_from_template, body);
  out.place_error_steps = EveryVoxelOf(finer.place_error_steps, times).Taken();
  out.confidence = Summarise(out.place_error_steps, body);
  return out;
}

}  // namespace kvx
