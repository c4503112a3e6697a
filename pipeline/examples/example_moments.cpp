// Second moments of the examples' displacements, summed in the order of the voxels.
#include "pipeline/examples/example_moments.h"

#include "pipeline/examples/expected_example.h"

namespace kvx {
namespace {

constexpr int kTurns = 3;
constexpr double kLeastShown = 0.05;  // of the body by a bone's weight: less teaches nothing

// What is left of a matrix without one row and the column of the same number.
Eigen::MatrixXd Minor(const Eigen::MatrixXd& whole, int without) {
  std::vector<int> kept;
  for (int k = 0; k < int(whole.rows()); ++k) {
    if (k != without) kept.push_back(k);
  }
  return whole(kept, kept);
}

using Displacements = std::vector<std::vector<Eigen::Vector3f>>;  // per scan, at some voxels

// d_k d_l at one voxel, mean of the three axes.
Eigen::MatrixXd ProductsAt(const Displacements& scans, size_t at) {
  Eigen::MatrixX3d d(scans.size(), 3);
  for (size_t k = 0; k < scans.size(); ++k) d.row(Eigen::Index(k)) = scans[k][at].cast<double>();
  return d * d.transpose() / 3;
}

ExampleMoments MomentsOf(const Displacements& scans, const std::vector<size_t>& voxels,
                         const WeightMap& weight_map, int bones) {
  const auto count = Eigen::Index(scans.size());
  ExampleMoments out;
  out.of_bones.assign(size_t(bones), Eigen::MatrixXd::Zero(count, count));
  std::vector<double> total(out.of_bones.size(), 0.0);
  for (size_t i = 0; i < voxels.size(); ++i) {
    const VoxelWeights& weights = weight_map.values[voxels[i]];
    const Eigen::MatrixXd products = ProductsAt(scans, i);
    for (int s = 0; s < kBonesPerVoxel; ++s) {
      out.of_bones[weights.bones[s]] += double(weights.weights[s]) * products;
      total[weights.bones[s]] += weights.weights[s];
    }
  }
  for (size_t bone = 0; bone < total.size(); ++bone) {
    if (total[bone] > 0) out.of_bones[bone] /= total[bone];
  }
  return out;
}

Eigen::MatrixXi Hidden(const std::vector<const ExampleSample*>& scans, const std::vector<size_t>& voxels,
                       const WeightMap& weight_map, int bones) {
  Eigen::MatrixXd shown = Eigen::MatrixXd::Zero(bones, Eigen::Index(scans.size()));
  Eigen::VectorXd all = Eigen::VectorXd::Zero(bones);
  for (size_t i = 0; i < voxels.size(); ++i) {
    const VoxelWeights& weights = weight_map.values[voxels[i]];
    for (int s = 0; s < kBonesPerVoxel; ++s) {
      all[weights.bones[s]] += weights.weights[s];
      for (size_t k = 0; k < scans.size(); ++k)
        shown(weights.bones[s], Eigen::Index(k)) += weights.weights[s] * scans[k]->shown_percent[i] / 100.0;
    }
  }
  return (shown.array() < (kLeastShown * all).replicate(1, shown.cols()).array()).cast<int>();
}

}  // namespace

ExampleMoments ExampleMoments::Without(int scan) const {
  ExampleMoments out;
  for (const Eigen::MatrixXd& moment : of_bones) out.of_bones.push_back(Minor(moment, scan));
  if (hidden.size() == 0) return out;
  out.hidden = Eigen::MatrixXi(hidden.rows(), hidden.cols() - 1);
  out.hidden << hidden.leftCols(scan), hidden.rightCols(hidden.cols() - 1 - scan);
  return out;
}

std::vector<int> ExampleMoments::ShownNear(size_t bone, int scans) const {
  std::vector<int> shown;
  for (int k = 0; k < scans; ++k) {
    if (!Hides(bone, k)) shown.push_back(k);
  }
  return shown;
}

Eigen::VectorXd ExampleMoments::KnownNear(size_t bone, int scans) const {
  Eigen::VectorXd known = Eigen::VectorXd::Zero(scans);
  for (const int shown : ShownNear(bone, scans)) known[shown] = 1;
  return known;
}

std::vector<Digest> CompareExamples::Inputs::Keys() const {
  std::vector<Digest> keys{body.key, weights.key, fit.key};
  for (const auto& sample : samples) keys.push_back(sample.key);
  return keys;
}

ExampleMoments CompareExamples::Run(const Inputs& inputs, const Options& options, StageContext&) {
  const std::vector<size_t> voxels = SampledVoxels(*inputs.body);
  std::vector<const ExampleSample*> scans;
  Displacements expected;
  std::vector<size_t> incomplete;
  for (const auto& sample : inputs.samples) {
    if (HiddenPart(*sample) > 0) incomplete.push_back(scans.size());
    scans.push_back(&*sample);
    expected.push_back(sample->mm);
  }
  ExampleMoments moments = MomentsOf(expected, voxels, *inputs.weights, options.bones);
  if (incomplete.empty()) return moments;
  const Eigen::MatrixXi hidden = Hidden(scans, voxels, *inputs.weights, options.bones);
  PoseSpace space(*inputs.fit);
  for (int turn = 0; turn < kTurns; ++turn) {
    for (const size_t k : incomplete)
      expected[k] = ExpectedExamples(scans, voxels, *inputs.weights, space, int(k));
    moments = MomentsOf(expected, voxels, *inputs.weights, options.bones);
    moments.hidden = hidden;
    space = PoseSpace(*inputs.fit, {}, moments);
  }
  return moments;
}

}  // namespace kvx
