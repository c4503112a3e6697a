// The template's body cut in bricks of 4x4x4 nodes (voxels): what the posing kernels keep per node, and
// nothing for air.
#pragma once
#include <Eigen/Dense>
#include <array>
#include <vector>

#include "kernels/device_buffer.h"

namespace kvx {

// The layout of kernels/cl/evd_bricks.cl.h.
struct BrickedBody {
  static constexpr int kEdge = 4, kNodes = 64;

  Eigen::Vector3i bricks = Eigen::Vector3i::Zero();  // along i, j, k
  std::vector<int32_t> brick_at;                     // dense, i fastest; -1: not stored
  std::vector<cl_int4> first_nodes;                  // per stored brick; those with cells come first
  int cell_bricks = 0;                  // the other stored bricks hold only nodes of their neighbours' cells
  std::vector<uint64_t> body, carried;  // a bit per node: body; body and its margin of air
  std::vector<uint8_t> closed;          // per brick with cells: all its 125 nodes are body
  std::vector<std::array<uint8_t, 4>> bones;  // per node, as VoxelWeights
  std::vector<std::array<float, 4>> weights;
  int example_count = 0;
  std::vector<int16_t> examples;  // [brick][example][axis][node], template voxels / example_scales
  std::vector<float> example_scales;

  int stored() const { return int(first_nodes.size()); }
  Eigen::Vector3i FirstNode(int brick) const {
    return {first_nodes[brick].s[0], first_nodes[brick].s[1], first_nodes[brick].s[2]};
  }
  int BrickOf(const Eigen::Vector3i& node) const;  // -1: not stored
  static int Slot(const Eigen::Vector3i& node) {
    return ((node.z() & 3) << 4) | ((node.y() & 3) << 2) | (node.x() & 3);
  }
  static Eigen::Vector3i Offset(int slot) { return {slot & 3, (slot >> 2) & 3, slot >> 4}; }
  bool Bit(const std::vector<uint64_t>& bits, const Eigen::Vector3i& node) const;
};

struct DeviceBody {
  DeviceBody(Backend& backend, const BrickedBody& body);
  DeviceBuffer<int32_t> brick_at;
  DeviceBuffer<cl_int4> first_nodes;
  DeviceBuffer<uint64_t> body, carried;
  DeviceBuffer<uint8_t> closed;
  DeviceBuffer<std::array<uint8_t, 4>> bones;
  DeviceBuffer<std::array<float, 4>> weights;
  DeviceBuffer<int16_t> examples;
  cl_int4 bricks;  // along i, j, k, and how many hold cells
  int stored, example_count;
};

// The posed place of every stored node, in voxels of the posed grid.
using PosedNodes = DeviceBuffer<cl_float4>;
// Which template cell lands on a posed voxel (kernels/cl/evd_bricks.cl.h).
using OwnerVolume = DeviceBuffer<uint32_t>;

}  // namespace kvx
