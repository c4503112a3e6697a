// Minimum cut on a box of voxels: links between neighbours (6, 18 or 26), one terminal link per voxel, whole
// numbers.
#pragma once
#include <cstdint>
#include <vector>

#include "core/image.h"

namespace kvx {

// Augmenting paths from two search trees (Boykov and Kolmogorov 2004). The links are implied by the lattice,
// so nothing is stored but capacities. Whole numbers: the cut value is exact, and the result the same in
// every run.
class LatticeCut {
 public:
  // `neighbours`: 6, 18 or 26.
  LatticeCut(const Eigen::Vector3i& size, int neighbours);

  int directions() const { return int(steps_.size()); }
  // The step (i, j, k) of a direction; direction d and directions() - 1 - d are opposite.
  const Eigen::Vector3i& Step(int direction) const { return steps_[direction]; }

  // Cost of the voxel on the source's side minus its cost on the sink's side: positive pulls it to the sink.
  void AddTerminal(const Eigen::Vector3i& voxel, int32_t source_minus_sink);
  // Cost when `voxel` is on the source's side and its neighbour on the sink's.
  void SetLink(const Eigen::Vector3i& voxel, int direction, int32_t capacity);

  // Returns the flow: the value of the minimum cut, less the constant that terminal links share.
  int64_t Solve();
  bool OnSourceSide(const Eigen::Vector3i& voxel) const { return tree_[Node(voxel)] == kSource; }

 private:
  enum Tree : uint8_t { kFree, kSource, kSink };
  static constexpr uint8_t kNoParent = 255, kTerminal = 254, kOrphan = 253;

  int64_t Node(const Eigen::Vector3i& v) const {  // one voxel of padding without links on every side
    return (int64_t(v.z() + 1) * padded_.y() + v.y() + 1) * padded_.x() + v.x() + 1;
  }
  int32_t& Capacity(int64_t node, int direction) { return capacity_[node * directions() + direction]; }
  int Opposite(int direction) const { return directions() - 1 - direction; }
  // Residual capacity between a node and its neighbour, in the direction in which the node's tree passes flow
  // on.
  int32_t Onward(int64_t node, int direction) {
    return tree_[node] == kSource ? Capacity(node, direction)
                                  : Capacity(node + offset_[direction], Opposite(direction));
  }
  int32_t Inward(int64_t node, int direction) {
    return tree_[node] == kSource ? Capacity(node + offset_[direction], Opposite(direction))
                                  : Capacity(node, direction);
  }
  void Activate(int64_t node);
  bool NextActive(int64_t& node);
  bool Grow(int64_t node, int64_t& meeting, int& direction);
  void Augment(int64_t node, int direction);
  int32_t Bottleneck(int64_t node, int32_t bound) const;
  void Push(int64_t node, int32_t flow);
  void Adopt(int64_t orphan);
  int DistanceToRoot(int64_t node);
  void MakeOrphan(int64_t node);

  Eigen::Vector3i padded_;
  std::vector<Eigen::Vector3i> steps_;
  std::vector<int64_t> offset_;
  std::vector<int32_t> capacity_, terminal_;  // terminal > 0: from the source, < 0: to the sink
  std::vector<uint8_t> tree_, parent_, queued_;
  std::vector<int32_t> distance_, stamp_;
  std::vector<int64_t> active_, later_, orphans_;
  size_t next_active_ = 0;
  int32_t time_ = 0;
  int64_t flow_ = 0;
};

}  // namespace kvx
