// Choice of samples.
#include "pipeline/bones/template/bone_samples.h"

#include <algorithm>
#include <cmath>

namespace kvx {
namespace {

// A fixed scatter of the integers: the smallest of it are an even random choice, the same on every machine.
uint64_t Scatter(uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

void KeepSome(std::vector<size_t>& voxels, size_t count) {
  if (voxels.size() <= count) return;
  std::nth_element(voxels.begin(), voxels.begin() + std::ptrdiff_t(count), voxels.end(),
                   [](size_t a, size_t b) { return Scatter(a) < Scatter(b); });
  voxels.resize(count);
  std::sort(voxels.begin(), voxels.end());
}

bool BelongsToAnother(const LabelMap& labels, int label, const PointMm& x) {
  const Eigen::Vector3i at = (labels.grid.ToVox(x).ijk.array() + 0.5).floor().cast<int>().matrix();
  if (!labels.grid.Contains(at)) return true;  // the template saw nothing there
  const int value = labels(at.x(), at.y(), at.z());
  return value != 0 && value != label;
}

}  // namespace

BoneSamples SampleBone(const BoneShape& shape, const LabelMap& labels, int label, const Volume& values,
                       double margin_mm, size_t count, bool everything) {
  const Grid& grid = shape.distance_mm.grid;
  std::vector<size_t> rim, core;
  for (size_t v = 0; v < shape.distance_mm.values.size(); ++v) {
    const double d = shape.distance_mm.values[v];
    if (d > margin_mm) continue;
    const PointMm x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()});
    if (!everything && BelongsToAnother(labels, label, x)) continue;
    if (!values.grid.Contains(values.grid.ToVox(x))) continue;
    (d > -margin_mm ? rim : core).push_back(v);
  }
  const size_t core_count = std::min(core.size(), count / 2);
  KeepSome(rim, count - core_count);
  KeepSome(core, count - std::min(count, rim.size()));
  BoneSamples samples;
  samples.centre_mm = shape.centroid_mm;
  rim.insert(rim.end(), core.begin(), core.end());
  for (const size_t v : rim) {
    const PointMm x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()});
    BoneSample sample;
    sample << (x.lps - shape.centroid_mm).cast<float>(), SampleTrilinear(values, values.grid.ToVox(x));
    samples.points.push_back(sample);
  }
  return samples;
}

VoxFromSample ToScanVoxels(const Grid& scan, const RigidTransform& scan_from_template,
                           const Eigen::Vector3d& centre_mm) {
  VoxFromSample out;
  out.leftCols<3>() = (scan.VoxFromMm() * scan_from_template.rotation.toRotationMatrix()).cast<float>();
  out.col(3) = scan.ToVox(scan_from_template * PointMm{centre_mm}).ijk.cast<float>();
  return out;
}

double EvidenceNats(double correlation, double inside, double independent_samples) {
  const double r = std::clamp(correlation, 0.0, 0.999);
  return -0.5 * inside * independent_samples * std::log(1 - r * r);
}

double WeakMatchNats(double correlation, double inside, double independent_samples) {
  const double missing =
      std::max(0.0, std::atanh(kWeakCorrelation) - std::atanh(std::clamp(correlation, -0.999, 0.999)));
  return -0.5 * inside * independent_samples * missing * missing;
}

double IndependentSamples(const Bone& bone) { return std::clamp(double(bone.voxels) / 32.0, 8.0, 100.0); }

}  // namespace kvx
