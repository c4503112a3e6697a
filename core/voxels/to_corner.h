// From the first corner of a cell between voxels to its corner n: a step along axis a where bit a is set.
#pragma once
#include <Eigen/Core>

namespace kvx {

inline Eigen::Vector3i ToCorner(int n) { return {n & 1, n >> 1 & 1, n >> 2 & 1}; }

}  // namespace kvx
