// Few combinations of scans show much the same tissue: each is solved once.
#include "pipeline/examples/expected_example.h"

#include <algorithm>

#include "core/host/parallel.h"

namespace kvx {
namespace {

constexpr int kLevels = 10;             // of how well a scan shows a voxel, beside not at all
constexpr size_t kVoxelsAtOnce = 4096;  // for one thread, which solves anew what others have solved

// At the n-th of the voxels.
ExamplesAt At(const std::vector<const ExampleSample*>& scans, size_t n) {
  ExamplesAt out{Eigen::Matrix3Xd(3, scans.size()), std::vector<uint8_t>(scans.size())};
  for (size_t k = 0; k < scans.size(); ++k) {
    out.mm.col(Eigen::Index(k)) = scans[k]->mm[n].cast<double>();
    out.shown_percent[k] = scans[k]->shown_percent[n];
  }
  return out;
}

}  // namespace

const Eigen::VectorXd& ExpectedExample::Coefficients(int bone, const std::vector<uint8_t>& shown_percent) {
  std::vector<uint8_t> key;
  Eigen::VectorXd known(shown_percent.size());
  for (const uint8_t percent : shown_percent) {
    key.push_back(uint8_t((percent * kLevels + 50) / 100));
    known[Eigen::Index(key.size()) - 1] = double(key.back()) / kLevels;
  }
  key.push_back(uint8_t(bone));
  auto found = solved_.find(key);
  if (found == solved_.end())
    found = solved_.emplace(std::move(key), space_.CoefficientsOfOthers(bone, scan_, known)).first;
  return found->second;
}

Eigen::Vector3d ExpectedExample::At(const VoxelWeights& weights, const ExamplesAt& examples) {
  const double shown = examples.shown_percent[size_t(scan_)] / 100.0;
  const Eigen::Vector3d own = examples.mm.col(scan_);
  if (shown == 1) return own;
  Eigen::Vector3d expected = Eigen::Vector3d::Zero();
  for (int s = 0; s < kBonesPerVoxel; ++s) {
    if (weights.weights[s] == 0) continue;
    expected +=
        double(weights.weights[s]) * (examples.mm * Coefficients(weights.bones[s], examples.shown_percent));
  }
  return shown * own + (1 - shown) * expected;
}

std::vector<Eigen::Vector3f> ExpectedExamples(const std::vector<const ExampleSample*>& scans,
                                              const std::vector<size_t>& voxels, const WeightMap& weights,
                                              const PoseSpace& space, int scan) {
  std::vector<Eigen::Vector3f> out(voxels.size());
  ParallelFor((voxels.size() + kVoxelsAtOnce - 1) / kVoxelsAtOnce, [&](size_t part) {
    ExpectedExample expected(space, scan);
    for (size_t n = part * kVoxelsAtOnce; n < std::min(voxels.size(), (part + 1) * kVoxelsAtOnce); ++n)
      out[n] = expected.At(weights.values[voxels[n]], At(scans, n)).cast<float>();
  });
  return out;
}

}  // namespace kvx
