// A lattice of nodes that behaves as soft, nearly incompressible tissue.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "core/grid.h"

namespace kvx {

enum class NodeKind : uint8_t { kAbsent, kFree, kFixed };

// Its energy is the stable neo-Hookean energy (Smith et al. 2018) of the frames that each node spans with its
// neighbours: the three edges from the node towards those of one octant. It is quadratic in the position of
// one node, so going to where it is least is an exact step, and the energy never rises. Nodes whose parities
// agree are independent: 8 colours.
struct ElasticLattice {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();  // nodes, x fastest
  Eigen::Vector3d rest_spacing_mm = Eigen::Vector3d::Ones();
  double handedness = 1;  // -1 where the axes at rest are left-handed
  std::vector<NodeKind> kinds;
  std::vector<uint8_t> joined;  // bit a: tissue all the way to the next node along axis a
  float air_stiffness = 0.02f;  // of frames with an edge through air, relative to tissue; at most 1
  // Second Lame constant over the first. 12 is a Poisson's ratio of 0.46: tissue is nearly incompressible;
  // much stiffer lattices lock.
  float volume_stiffness = 12;
  // Empty, or per node, relative to other tissue, at least 1: a frame is as stiff as the stiffest of its
  // nodes.
  std::vector<float> stiffness;
  // A sweep on the device passes over nodes around which none has moved further than this since the sweep
  // before.
  float still_mm = 0;
  std::vector<Eigen::Vector3f> positions_mm;
  // Empty, or per cell of hold_nodes (1 or 2) nodes along every axis (size is a multiple of it) how firmly
  // each of its nodes is held to its place in held_mm: half (x - held)^T hold (x - held) is added to the
  // energy.
  std::span<const Eigen::Matrix3f> holds;
  int hold_nodes = 1;
  std::span<const Eigen::Vector3f> held_mm;

  size_t Index(int i, int j, int k) const { return (size_t(k) * size.y() + j) * size.x() + i; }
  Eigen::Vector3i NodeAt(size_t index) const {
    const size_t row = index / size_t(size.x());
    return {int(index % size_t(size.x())), int(row % size_t(size.y())), int(row / size_t(size.y()))};
  }
  const Eigen::Matrix3f& HoldOf(const Eigen::Vector3i& node) const {
    const Eigen::Vector3i cells = size / hold_nodes, c = node / hold_nodes;
    return holds[(size_t(c.z()) * cells.y() + c.y()) * cells.x() + c.x()];
  }
};

// Of the sweeps: smooth errors settle in a third of those that it would take without.
constexpr float kElasticOverRelaxation = 1.6f;

}  // namespace kvx
