// How the tissue between the bones comes to rest at a pose, where examples tell only how it lies in theirs.
#pragma once
#include <memory>
#include <mutex>

#include "kernels/added_displacement.h"
#include "kernels/bricked_body.h"
#include "pipeline/posing/resolved_pose.h"
#include "pipeline/registration/tissue/elastic_tissue.h"

namespace kvx {

// Per training scan where it says so.
struct EquilibriumInputs {
  const Mask& body;
  const LabelMap& bone_labels;
  const WeightMap& weights;
  const BrickedBody& bricked;                      // the examples
  const std::vector<PoseVector>& scan_poses;       // scan_from_template per scan
  const std::vector<Eigen::MatrixXf>& known_from;  // bones x scans per scan: which scans' equilibria its own
                                                   // is made of; empty: of its own
  const std::vector<Eigen::MatrixXf>& without_scan;  // coefficients there as the other scans lead to expect;
                                                     // empty: the share is 1
  const ExampleMoments& moments;                     // what scans hide
};

// With E(P) the displacement before the bones' blend (as d_k of eq. 7) of elastic tissue at ease in pose P,
// eq. 6 becomes v_a = M (v_0 + sum_k c_k d_k + s (E(P) - sum_k c_k E(P_k))): at the scans' poses nothing
// changes, and what examples say beyond elastic tissue is interpolated as before. The share s, 0 to 1, is
// learned from the scans (elastic_shares.h). On a lattice of every few template voxels: E is smooth.
// Thread-safe; keeps references to nothing but the backend.
class PoseEquilibrium {
 public:
  PoseEquilibrium(const EquilibriumInputs& inputs, Backend& backend);

  // s (E(P) - sum_k c_k E(P_k)), in template voxels. Those of the last poses are kept.
  std::shared_ptr<const AddedDisplacement> BeyondExamples(const ResolvedPose& pose) const;

 private:
  // A node of the lattice in tissue or near it.
  struct Node {
    size_t index;
    Eigen::Vector3d template_mm;
    VoxelWeights weights;
    bool soft = false;  // tissue, no bone
  };
  Eigen::Vector3i VoxelOf(size_t node) const;  // of the template
  std::vector<Node> NodesNear(const EquilibriumInputs& inputs) const;
  std::vector<Eigen::Vector3f> At(PoseVector pose) const;  // E at nodes_, mm
  std::shared_ptr<const AddedDisplacement> Made(const ResolvedPose& pose) const;
  std::vector<Eigen::Vector3f> Mixed(const std::vector<std::vector<Eigen::Vector3f>>& of_scans,
                                     const Eigen::MatrixXf& coefficients) const;
  std::vector<float> LearnedShares(const EquilibriumInputs& inputs) const;

  const Eigen::Vector3i step_;
  const WorkRegion region_;  // of every step-th voxel, as all that follows
  const Volume beyond_coat_mm_;
  const ElasticTissue tissue_;
  const std::vector<Node> nodes_;  // elsewhere nothing is added
  const Eigen::Matrix3f template_vox_from_mm_;
  std::vector<std::vector<Eigen::Vector3f>> at_scans_;
  std::vector<float> shares_;  // at nodes_
  mutable std::mutex mutex_;
  struct Kept {
    ResolvedPose pose;
    std::shared_ptr<const AddedDisplacement> added;
  };
  mutable std::vector<Kept> kept_;  // the last asked for comes first
};

}  // namespace kvx
