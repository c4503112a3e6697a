// What a pose adds to its examples' displacements (eq. 6), on a lattice of every few template voxels.
#pragma once
#include <Eigen/Dense>
#include <vector>

namespace kvx {

struct AddedDisplacement {
  Eigen::Vector3i first = Eigen::Vector3i::Zero();  // template voxel of node 0; may lie outside the template
  Eigen::Vector3i step = Eigen::Vector3i::Ones();   // template voxels from node to node
  Eigen::Vector3i size = Eigen::Vector3i::Zero();   // nodes
  std::vector<Eigen::Vector3f> voxels;              // i fastest; template voxels

  // Trilinear between the nodes, and beyond them as at the nearest place between them.
  Eigen::Vector3d At(const Eigen::Vector3i& template_voxel) const;
};

}  // namespace kvx
