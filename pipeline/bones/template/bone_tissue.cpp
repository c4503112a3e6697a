// Which voxels count, and what is known of each.
#include "pipeline/bones/template/bone_tissue.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "core/voxels/distance_map.h"

namespace kvx {
namespace {

constexpr double kMarginMm = 3.0, kMarginVoxels = 1.5;  // of tissue around a bone, the larger of the two
constexpr size_t kMostSamples = 24000;

uint64_t Scatter(uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  return x ^ (x >> 27);
}

void KeepEvenly(std::vector<size_t>& voxels) {
  if (voxels.size() <= kMostSamples) return;
  std::nth_element(voxels.begin(), voxels.begin() + kMostSamples, voxels.end(),
                   [](size_t a, size_t b) { return Scatter(a) < Scatter(b); });
  voxels.resize(kMostSamples);
  std::sort(voxels.begin(), voxels.end());
}

TissueSample SampleAt(const CubicImage& image, const Eigen::Vector3i& at, const Eigen::Vector3d& centre_mm) {
  TissueSample sample;
  Eigen::Vector3d per_voxel;
  image.At(at.cast<double>(), sample.value, per_voxel);
  sample.gradient = image.grid().VoxFromMm().transpose() * per_voxel;
  sample.from_centre_mm = image.grid().ToMm(PointVox{at.cast<double>()}).lps - centre_mm;
  return sample;
}

void Weigh(const VoxelWeights& weights, int bone, TissueSample& sample) {
  sample.own_weight = 0;
  for (int s = 0; s < kBonesPerVoxel; ++s) {
    if (weights.weights[s] <= 0) continue;
    if (weights.bones[s] == bone)
      sample.own_weight = weights.weights[s];
    else
      sample.others.emplace_back(weights.bones[s], weights.weights[s]);
  }
}

BoneTissue TissueOf(const BoneSet& bones, int b, const CubicImage& image, const WeightMap& weights) {
  const Bone& bone = bones.bones[b];
  const Grid& grid = bones.labels.grid;
  BoneTissue tissue{bone.centroid, 0, grid.MeanSpacingMm(), Eigen::Matrix3d::Zero(), {}, {}};
  const double margin_mm = std::max(kMarginMm, kMarginVoxels * tissue.voxel_mm);
  const Volume distance = SignedDistance(bones.labels, bone.label, margin_mm);
  std::vector<size_t> near;
  for (size_t v = 0; v < distance.values.size(); ++v) {
    if (distance.values[v] <= margin_mm) near.push_back(v);
  }
  const Eigen::Vector3d low = grid.ToVox(distance.grid.origin).ijk;
  const Eigen::Vector3i offset = (low.array() + 0.5).floor().cast<int>().matrix();
  std::erase_if(near, [&](size_t v) {
    const Eigen::Vector3i at = distance.grid.Ijk(v) + offset;
    if (!grid.Contains(at)) return true;
    const int label = bones.labels(at.x(), at.y(), at.z());
    return label != 0 && label != bone.label;
  });
  KeepEvenly(near);
  tissue.sample_at = Image<int32_t>(distance.grid, kNoSample);
  for (size_t n = 0; n < near.size(); ++n) tissue.sample_at.values[near[n]] = int32_t(n);
  double squares = 0;
  size_t inside = 0, around = 0;
  for (const size_t v : near) {
    const Eigen::Vector3i at = distance.grid.Ijk(v) + offset;
    TissueSample sample = SampleAt(image, at, bone.centroid.lps);
    sample.away_mm = std::max(0.0, double(distance.values[v]));
    Weigh(weights(at.x(), at.y(), at.z()), b, sample);
    if (distance.values[v] < 0) squares += sample.from_centre_mm.squaredNorm(), ++inside;
    if (sample.away_mm > 0) {
      const Eigen::Vector3d& r = sample.from_centre_mm;
      tissue.lever_mm2 += r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose(), ++around;
    }
    tissue.samples.push_back(std::move(sample));
  }
  tissue.radius_mm = std::max(1e-3, std::sqrt(squares / double(std::max<size_t>(1, inside))));
  tissue.lever_mm2 /= double(std::max<size_t>(1, around));
  return tissue;
}

}  // namespace

std::vector<BoneTissue> SampleTissue(const BoneSet& bones, const CubicImage& template_image,
                                     const WeightMap& weights) {
  std::vector<BoneTissue> tissue(bones.size());
  ParallelFor(bones.size(), [&](size_t b) { tissue[b] = TissueOf(bones, int(b), template_image, weights); });
  return tissue;
}

}  // namespace kvx
