// Minimum cut on voxels of a box, all or some: links between neighbours (6, 18 or 26), one terminal link per
// voxel, whole numbers. Several layers of the same box can lie one on the other.
#pragma once
#include <cstdint>
#include <vector>

#include "core/image.h"

namespace kvx {

// Augmenting paths from two search trees (Boykov and Kolmogorov 2004). Only voxels that take part cost more
// than a number. Whole numbers: the cut value is exact, and the result the same in every run.
class LatticeCut {
 public:
  // `size`: of the box. `neighbours`: 6, 18 or 26. `taking_part`: 1 for voxels that do, i fastest, layer by
  // layer; empty: all. Slice k of layer l is number k + l * size.z() to the calls below.
  LatticeCut(const Eigen::Vector3i& size, int neighbours, const std::vector<uint8_t>& taking_part = {},
             int layers = 1);

  int directions() const { return int(steps_.size()) - 2 * first_; }
  // The step (i, j, k) of a direction; direction d and directions() - 1 - d are opposite.
  const Eigen::Vector3i& Step(int direction) const { return steps_[first_ + direction]; }

  // Cost of the voxel on the source's side minus its cost on the sink's side: positive pulls it to the sink.
  void AddTerminal(const Eigen::Vector3i& voxel, int32_t source_minus_sink);
  // Cost when `voxel` is on the source's side and its neighbour on the sink's. Both take part, in one layer.
  void SetLink(const Eigen::Vector3i& voxel, int direction, int32_t capacity);
  // The same of a voxel and its place in the next layer.
  void SetLinkToNextLayer(const Eigen::Vector3i& voxel, int32_t capacity);

  // Returns the flow: the value of the minimum cut, less the constant that terminal links share.
  int64_t Solve();
  bool OnSourceSide(const Eigen::Vector3i& voxel) const { return tree_[Node(voxel)] == kSource; }

 private:
  enum Tree : uint8_t { kFree, kSource, kSink };
  static constexpr uint8_t kNoParent = 255, kTerminal = 254, kOrphan = 253;

  using NodeId = int32_t;  // 0: no voxel, has no links

  NodeId Node(const Eigen::Vector3i& v) const {
    return id_[(size_t(v.z()) * size_.y() + v.y()) * size_.x() + v.x()];
  }
  void NumberNodes(const std::vector<uint8_t>& taking_part);
  void FindNeighbours();
  size_t Slot(NodeId node, int direction) const { return size_t(node) * steps_.size() + direction; }
  NodeId Next(NodeId node, int direction) const { return next_[Slot(node, direction)]; }
  int32_t& Capacity(NodeId node, int direction) { return capacity_[Slot(node, direction)]; }
  int Opposite(int direction) const { return int(steps_.size()) - 1 - direction; }
  // Residual capacity between a node and its neighbour, in the direction in which the node's tree passes flow
  // on.
  int32_t Onward(NodeId node, int direction) {
    return tree_[node] == kSource ? Capacity(node, direction)
                                  : Capacity(Next(node, direction), Opposite(direction));
  }
  int32_t Inward(NodeId node, int direction) {
    return tree_[node] == kSource ? Capacity(Next(node, direction), Opposite(direction))
                                  : Capacity(node, direction);
  }
  void Activate(NodeId node);
  bool NextActive(NodeId& node);
  bool Grow(NodeId node, NodeId& meeting, int& direction);
  void Augment(NodeId node, int direction);
  int32_t Bottleneck(NodeId node, int32_t bound) const;
  void Push(NodeId node, int32_t flow);
  void Adopt(NodeId orphan);
  int DistanceToRoot(NodeId node);
  void MakeOrphan(NodeId node);

  Eigen::Vector3i size_;  // of all layers
  int first_;             // of the steps within a layer: before and behind them are those between layers
  std::vector<Eigen::Vector3i> steps_;
  std::vector<NodeId> id_;                    // of every voxel of the box, layer by layer
  std::vector<NodeId> next_;                  // by node and direction
  std::vector<int32_t> capacity_, terminal_;  // terminal > 0: from the source, < 0: to the sink
  std::vector<uint8_t> tree_, parent_, queued_;
  std::vector<int32_t> distance_, stamp_;
  std::vector<NodeId> active_, later_, orphans_;
  size_t next_active_ = 0;
  int32_t time_ = 0;
  int64_t flow_ = 0;
};

}  // namespace kvx
