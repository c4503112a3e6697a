// Least squares for a bone's motion together with the gain and the bias of its scan: normal equations, summed
// up sample by sample.
#pragma once
#include <Eigen/Core>

namespace kvx {

struct PoseEquations {
  using Row = Eigen::Matrix<double, 8, 1>;  // turn, shift, gain, bias
  using Normal = Eigen::Matrix<double, 8, 8>;

  Normal normal = Normal::Zero();
  Row right = Row::Zero();

  // row . x = value, of this weight. Both triangles at once: of eight unknowns that is quicker than either.
  void Add(const Row& row, double weight, double value) {
    const Row weighted = weight * row;
    normal.noalias() += weighted * row.transpose();
    right += value * weighted;
  }
};

}  // namespace kvx
