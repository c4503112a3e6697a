// The template's body cut in bricks of 4x4x4 nodes (voxels): what the posing kernels keep per node, and
// nothing for air.
#pragma once
#include <Eigen/Dense>
#include <array>
#include <vector>

#include "core/weight_map.h"
#include "kernels/device/device_buffer.h"

namespace kvx {

// The layout of kernels/cl/evd_bricks.cl.h.
// Vectors named `..._first` hold one more entry than there are bricks.
struct BrickedBody {
  static constexpr int kEdge = 4, kNodes = 64;

  Eigen::Vector3i bricks = Eigen::Vector3i::Zero();  // along i, j, k
  std::vector<int32_t> brick_at;                     // dense, i fastest; -1: not stored
  std::vector<cl_int4> first_nodes;                  // per stored brick; those with cells come first
  int cell_bricks = 0;         // the other stored bricks hold only nodes of their neighbours' cells
  std::vector<uint64_t> body;  // a bit per node
  // Per brick with cells, bits of its 5x5x5 nodes:
  // body, carried (body and its margin of air), inner (body with no air beside it), bone.
  using Tissue = std::array<uint32_t, 16>;
  std::vector<Tissue> tissue;
  // Per brick with cells, a bit per unit cell: joins parts that may draw apart; lies beside such a cell.
  std::vector<std::array<uint64_t, 2>> cuts;
  std::vector<uint32_t> palette_first;
  std::vector<uint8_t> palette;      // the bones that move a brick
  std::vector<float> weights;        // [palette entry][node]
  std::vector<float> weight_ranges;  // [palette entry]: least, greatest
  struct Example {
    int32_t k;
    float scale;
  };
  int example_count = 0;
  std::vector<uint32_t> example_first;
  std::vector<Example> example_refs;  // the examples that displace a brick
  std::vector<int16_t> examples;      // [reference][axis][node], template voxels / scale
  std::vector<float> example_ranges;  // [reference]: least x, y, z, greatest x, y, z, template voxels

  int stored() const { return int(first_nodes.size()); }
  Eigen::Vector3i FirstNode(int brick) const {
    return {first_nodes[brick].s[0], first_nodes[brick].s[1], first_nodes[brick].s[2]};
  }
  // Between a brick's place along i, j, k and its index in `brick_at`.
  size_t BrickIndex(const Eigen::Vector3i& place) const {
    return (size_t(place.z()) * bricks.y() + place.y()) * bricks.x() + place.x();
  }
  Eigen::Vector3i BrickPlace(size_t index) const {
    return {int(index % bricks.x()), int(index / bricks.x() % bricks.y()),
            int(index / bricks.x() / bricks.y())};
  }
  int BrickOf(const Eigen::Vector3i& node) const;  // -1: not stored
  static int Slot(const Eigen::Vector3i& node) {
    return ((node.z() & 3) << 4) | ((node.y() & 3) << 2) | (node.x() & 3);
  }
  static Eigen::Vector3i Offset(int slot) { return {slot & 3, (slot >> 2) & 3, slot >> 4}; }
  bool IsBody(const Eigen::Vector3i& node) const;
  // Of a brick with cells; `offset` 0..4 along each axis from its first node.
  bool IsBody(int brick, const Eigen::Vector3i& offset) const { return TissueBit(brick, 0, offset); }
  bool IsCarried(int brick, const Eigen::Vector3i& offset) const { return TissueBit(brick, 4, offset); }
  bool IsInner(int brick, const Eigen::Vector3i& offset) const { return TissueBit(brick, 8, offset); }
  bool IsBone(int brick, const Eigen::Vector3i& offset) const { return TissueBit(brick, 12, offset); }
  VoxelWeights NodeWeights(int brick, int slot) const;
  // Of the cell above each node, i fastest over all bricks: its bone << 8 | a bit per corner in that bone,
  // and 16 bits higher the same of a second bone; of more than two those with most corners.
  std::vector<uint32_t> BoneCells() const;
  // Whether all sizes and references go with each other: kernels believe them. Bones are not looked at.
  bool IsConsistent() const;
  Eigen::Vector3d NodeExample(size_t reference, int slot) const;  // template voxels

 private:
  int BoneOf(int brick, const Eigen::Vector3i& offset) const;
  bool HasConsistentBricks() const;
  bool HasConsistentLists() const;
  bool TissueBit(int brick, int word, const Eigen::Vector3i& offset) const {
    const int bit = (offset.z() * 5 + offset.y()) * 5 + offset.x();
    return (tissue[brick][word + (bit >> 5)] >> (bit & 31)) & 1;
  }
};

struct DeviceBody {
  DeviceBody(Backend& backend, const BrickedBody& body);
  DeviceBuffer<int32_t> brick_at;
  DeviceBuffer<cl_int4> first_nodes;
  DeviceBuffer<uint64_t> body;
  DeviceBuffer<BrickedBody::Tissue> tissue;
  DeviceBuffer<std::array<uint64_t, 2>> cuts;
  DeviceBuffer<uint32_t> palette_first;
  DeviceBuffer<uint8_t> palette;
  DeviceBuffer<float> weights, weight_ranges;
  DeviceBuffer<uint32_t> example_first;
  DeviceBuffer<BrickedBody::Example> example_refs;
  DeviceBuffer<int16_t> examples;
  DeviceBuffer<float> example_ranges;
  cl_int4 bricks;  // along i, j, k, and how many hold cells
  int stored;
  DeviceBuffer<uint32_t> bone_cells;
  cl_int4 bone_size;  // of `bone_cells`
};

}  // namespace kvx
