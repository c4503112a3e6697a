// Second moments of the examples' displacements, summed in the order of the voxels.
#include "pipeline/examples/example_moments.h"

namespace kvx {
namespace {

// What is left of a matrix without one row and the column of the same number.
Eigen::MatrixXd Minor(const Eigen::MatrixXd& whole, int without) {
  std::vector<int> kept;
  for (int k = 0; k < int(whole.rows()); ++k) {
    if (k != without) kept.push_back(k);
  }
  return whole(kept, kept);
}

// d_k d_l at one voxel, mean of the three axes.
Eigen::MatrixXd ProductsAt(const std::vector<Artifact<SampleExample::Output>>& samples, size_t at) {
  Eigen::MatrixX3d d(samples.size(), 3);
  for (size_t k = 0; k < samples.size(); ++k) d.row(Eigen::Index(k)) = (*samples[k])[at].cast<double>();
  return d * d.transpose() / 3;
}

}  // namespace

ExampleMoments ExampleMoments::Without(int scan) const {
  ExampleMoments out;
  for (const Eigen::MatrixXd& moment : of_bones) out.of_bones.push_back(Minor(moment, scan));
  return out;
}

std::vector<Digest> CompareExamples::Inputs::Keys() const {
  std::vector<Digest> keys{body.key, weights.key};
  for (const auto& sample : samples) keys.push_back(sample.key);
  return keys;
}

ExampleMoments CompareExamples::Run(const Inputs& inputs, const Options& options, StageContext&) {
  const auto scans = Eigen::Index(inputs.samples.size());
  ExampleMoments out;
  out.of_bones.assign(size_t(options.bones), Eigen::MatrixXd::Zero(scans, scans));
  std::vector<double> total(out.of_bones.size(), 0.0);
  const std::vector<size_t> voxels = SampledVoxels(*inputs.body);
  for (size_t i = 0; i < voxels.size(); ++i) {
    const VoxelWeights& weights = inputs.weights->values[voxels[i]];
    const Eigen::MatrixXd products = ProductsAt(inputs.samples, i);
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

}  // namespace kvx
