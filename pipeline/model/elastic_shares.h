// How far the scans bear out that tissue comes to rest as elastic tissue would, bone by bone.
#pragma once
#include <Eigen/Dense>

#include "core/weight_map.h"

namespace kvx {

// Every scan is predicted from the others. What they leave unexplained of its displacement, at places in soft
// tissue, is fitted by what elastic tissue does beyond them there: least squares over the places that move
// with a bone. All scans count alike, however far they are bent.
class ElasticShares {
 public:
  // `noise_mm`: of displacements; elastic tissue that moves by less tells nothing. At least 0.
  ElasticShares(size_t bones, size_t scans, double noise_mm);

  // At one place that the scan shows; mm.
  void Add(size_t scan, const VoxelWeights& weights, const Eigen::Vector3f& unexplained_mm,
           const Eigen::Vector3f& elastic_mm);
  // Per bone, 0 to 1. Bones with little evidence are as all together, and these without any 1.
  Eigen::VectorXd Learned() const;

 private:
  double noise_mm_;
  Eigen::MatrixXd both_, elastic_, unexplained_;  // bones x scans: sums of products, mm^2
  Eigen::MatrixXd places_;                        // bones x scans: sums of weights
};

}  // namespace kvx
