// Sums of products per bone and scan.
#include "pipeline/model/elastic_shares.h"

#include <algorithm>

namespace kvx {
namespace {

constexpr double kLeast = 1e-3;  // unexplained, over what is elastic: the others explain nothing better
constexpr double kCommon = 0.1;  // what all bones say, in mean bones' evidence

}  // namespace

ElasticShares::ElasticShares(size_t bones, size_t scans, double noise_mm)
    : noise_mm_(noise_mm),
      both_(Eigen::MatrixXd::Zero(Eigen::Index(bones), Eigen::Index(scans))),
      elastic_(both_),
      unexplained_(both_),
      places_(both_) {}

void ElasticShares::Add(size_t scan, const VoxelWeights& weights, const Eigen::Vector3f& unexplained_mm,
                        const Eigen::Vector3f& elastic_mm) {
  const auto k = Eigen::Index(scan);
  for (int s = 0; s < kBonesPerVoxel; ++s) {
    const Eigen::Index bone = weights.bones[s];
    both_(bone, k) += double(weights.weights[s]) * double(unexplained_mm.dot(elastic_mm));
    elastic_(bone, k) += double(weights.weights[s]) * double(elastic_mm.squaredNorm());
    unexplained_(bone, k) += double(weights.weights[s]) * double(unexplained_mm.squaredNorm());
    places_(bone, k) += double(weights.weights[s]);
  }
}

// As of a normal distribution about 1 before, by which elastic tissue is uncertain as much as displacements.
Eigen::VectorXd ElasticShares::Learned() const {
  Eigen::VectorXd of_scan = (unexplained_ + kLeast * elastic_).colwise().sum().transpose();
  for (double& scan : of_scan) scan = scan > 0 ? 1 / scan : 0;
  const Eigen::VectorXd before = noise_mm_ * noise_mm_ * places_ * of_scan;
  const Eigen::VectorXd both = both_ * of_scan + before, elastic = elastic_ * of_scan + before;
  if (!(elastic.sum() > 0)) return Eigen::VectorXd::Ones(both_.rows());
  const double common = both.sum() / elastic.sum(), pull = kCommon * elastic.mean();
  return ((both.array() + pull * common) / (elastic.array() + pull)).max(0.0).min(1.0).matrix();
}

}  // namespace kvx
