// What the other scans lead to expect of a scan where it shows nothing.
#pragma once
#include <map>
#include <vector>

#include "core/weight_map.h"
#include "pipeline/examples/pose_space.h"
#include "pipeline/examples/sample_example.h"

namespace kvx {

// Of all scans at one voxel: displacements, and how well each shows the voxel.
struct ExamplesAt {
  Eigen::Matrix3Xd mm;  // template frame, 3 x scans
  std::vector<uint8_t> shown_percent;
};

// Where it shows a voxel a scan's example is its own, elsewhere it is the most likely displacement at its
// pose given the others. Interpolation through such a value is the same as without it, so a scan of which a
// bone is lost does not mislead. Remembers what it has solved; for one thread.
class ExpectedExample {
 public:
  ExpectedExample(const PoseSpace& space, int scan) : space_(space), scan_(scan) {}
  Eigen::Vector3d At(const VoxelWeights& weights, const ExamplesAt& examples);

 private:
  const Eigen::VectorXd& Coefficients(int bone, const std::vector<uint8_t>& shown_percent);

  const PoseSpace& space_;
  int scan_;
  std::map<std::vector<uint8_t>, Eigen::VectorXd>
      solved_;  // by levels of what is shown, the bone behind them
};

// The same at all of some voxels of a body; `scans`: sampled there.
std::vector<Eigen::Vector3f> ExpectedExamples(const std::vector<const ExampleSample*>& scans,
                                              const std::vector<size_t>& voxels, const WeightMap& weights,
                                              const PoseSpace& space, int scan);

}  // namespace kvx
