// Grow both trees until they touch, push along the path, mend the trees; the names follow the paper.
#include "pipeline/segmentation/cuts/lattice_cut.h"

#include <algorithm>
#include <limits>

namespace kvx {

namespace {

// Half of them in the order of memory, so that the opposites lie mirrored. `layer`: slices from a layer to
// the next, 0 for one layer.
std::vector<Eigen::Vector3i> StepsOf(int neighbours, int layer) {
  const int most = neighbours == 6 ? 1 : neighbours == 18 ? 2 : 3;
  std::vector<Eigen::Vector3i> steps;
  if (layer > 0) steps.emplace_back(0, 0, -layer);
  for (int k = -1; k <= 1; ++k) {
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i) {
        const int moved = std::abs(i) + std::abs(j) + std::abs(k);
        if (moved > 0 && moved <= most) steps.emplace_back(i, j, k);
      }
    }
  }
  if (layer > 0) steps.emplace_back(0, 0, layer);
  return steps;
}

}  // namespace

LatticeCut::LatticeCut(const Eigen::Vector3i& size, int neighbours, const std::vector<uint8_t>& taking_part,
                       int layers)
    : size_(size.x(), size.y(), layers * size.z()),
      first_(layers > 1 ? 1 : 0),
      steps_(StepsOf(neighbours, layers > 1 ? size.z() : 0)) {
  NumberNodes(taking_part);
  FindNeighbours();
  const size_t nodes = next_.size() / steps_.size();
  capacity_.assign(next_.size(), 0);
  terminal_.assign(nodes, 0);
  tree_.assign(nodes, kFree);
  parent_.assign(nodes, kNoParent);
  queued_.assign(nodes, 0);
  distance_.assign(nodes, 0);
  stamp_.assign(nodes, 0);
}

void LatticeCut::NumberNodes(const std::vector<uint8_t>& taking_part) {
  id_.assign(size_t(size_.x()) * size_.y() * size_.z(), 0);
  NodeId count = 0;
  for (size_t v = 0; v < id_.size(); ++v) {
    if (taking_part.empty() || taking_part[v]) id_[v] = ++count;
  }
  next_.assign((size_t(count) + 1) * steps_.size(), 0);
}

void LatticeCut::FindNeighbours() {
  size_t slot = steps_.size();
  for (size_t v = 0; v < id_.size(); ++v) {
    if (id_[v] == 0) continue;
    const Eigen::Vector3i at(int(v % size_.x()), int(v / size_.x() % size_.y()),
                             int(v / size_.x() / size_.y()));
    for (const Eigen::Vector3i& step : steps_) {
      const Eigen::Vector3i to = at + step;
      const bool inside = (to.array() >= 0).all() && (to.array() < size_.array()).all();
      next_[slot++] = inside ? Node(to) : 0;
    }
  }
}

void LatticeCut::AddTerminal(const Eigen::Vector3i& voxel, int32_t source_minus_sink) {
  terminal_[Node(voxel)] -= source_minus_sink;
}

void LatticeCut::SetLink(const Eigen::Vector3i& voxel, int direction, int32_t capacity) {
  Capacity(Node(voxel), first_ + direction) = capacity;
}

void LatticeCut::SetLinkToNextLayer(const Eigen::Vector3i& voxel, int32_t capacity) {
  Capacity(Node(voxel), int(steps_.size()) - 1) = capacity;
}

void LatticeCut::Activate(NodeId node) {
  if (queued_[node]) return;
  queued_[node] = 1;
  later_.push_back(node);
}

bool LatticeCut::NextActive(NodeId& node) {
  while (true) {
    if (next_active_ == active_.size()) {
      active_.clear();
      active_.swap(later_);
      next_active_ = 0;
      if (active_.empty()) return false;
    }
    node = active_[next_active_++];
    queued_[node] = 0;
    if (tree_[node] != kFree) return true;
  }
}

// Takes free neighbours into the node's tree; true when it met the other tree across `direction`.
bool LatticeCut::Grow(NodeId node, NodeId& meeting, int& direction) {
  for (int d = 0; d < int(steps_.size()); ++d) {
    if (Onward(node, d) == 0) continue;
    const NodeId next = Next(node, d);
    if (tree_[next] == kFree) {
      tree_[next] = tree_[node];
      parent_[next] = uint8_t(Opposite(d));
      stamp_[next] = stamp_[node];
      distance_[next] = distance_[node] + 1;
      Activate(next);
    } else if (tree_[next] != tree_[node]) {
      meeting = tree_[node] == kSource ? node : next;
      direction = tree_[node] == kSource ? d : Opposite(d);
      return true;
    } else if (stamp_[next] <= stamp_[node] &&
               distance_[next] > distance_[node]) {  // a shorter way to the root
      parent_[next] = uint8_t(Opposite(d));
      stamp_[next] = stamp_[node];
      distance_[next] = distance_[node] + 1;
    }
  }
  return false;
}

int32_t LatticeCut::Bottleneck(NodeId node, int32_t bound) const {
  const bool source = tree_[node] == kSource;
  while (parent_[node] != kTerminal) {
    const int d = parent_[node];
    const NodeId up = Next(node, d);
    bound = std::min(bound, source ? capacity_[Slot(up, Opposite(d))] : capacity_[Slot(node, d)]);
    node = up;
  }
  return std::min(bound, std::abs(terminal_[node]));
}

void LatticeCut::Push(NodeId node, int32_t flow) {
  const bool source = tree_[node] == kSource;
  while (parent_[node] != kTerminal) {
    const int d = parent_[node];
    const NodeId up = Next(node, d);
    int32_t& along = source ? Capacity(up, Opposite(d)) : Capacity(node, d);
    int32_t& against = source ? Capacity(node, d) : Capacity(up, Opposite(d));
    along -= flow;
    against += flow;
    if (along == 0) MakeOrphan(node);
    node = up;
  }
  terminal_[node] += source ? -flow : flow;
  if (terminal_[node] == 0) MakeOrphan(node);
}

void LatticeCut::MakeOrphan(NodeId node) {
  parent_[node] = kOrphan;
  orphans_.push_back(node);
}

void LatticeCut::Augment(NodeId node, int direction) {
  const NodeId other = Next(node, direction);
  const int32_t flow = Bottleneck(other, Bottleneck(node, Capacity(node, direction)));
  Capacity(node, direction) -= flow;
  Capacity(other, Opposite(direction)) += flow;
  Push(node, flow);
  Push(other, flow);
  flow_ += flow;
}

// Steps from the node to its terminal, -1 when the way ends at an orphan. Stamps the way.
int LatticeCut::DistanceToRoot(NodeId node) {
  int steps = 0;
  for (NodeId at = node;; at = Next(at, parent_[at]), ++steps) {
    if (stamp_[at] == time_) {
      steps += distance_[at];
      break;
    }
    if (parent_[at] == kOrphan || parent_[at] == kNoParent) return -1;
    if (parent_[at] == kTerminal) {
      stamp_[at] = time_;
      distance_[at] = 0;
      break;
    }
  }
  int left = steps;
  for (NodeId at = node; stamp_[at] != time_; at = Next(at, parent_[at])) {
    stamp_[at] = time_;
    distance_[at] = left--;
  }
  return steps;
}

void LatticeCut::Adopt(NodeId orphan) {
  int best = std::numeric_limits<int>::max(), parent = -1;
  for (int d = 0; d < int(steps_.size()); ++d) {
    const NodeId next = Next(orphan, d);
    if (tree_[next] != tree_[orphan] || Inward(orphan, d) == 0) continue;
    const int steps = DistanceToRoot(next);
    if (steps >= 0 && steps < best) best = steps, parent = d;
  }
  if (parent >= 0) {
    parent_[orphan] = uint8_t(parent);
    stamp_[orphan] = time_;
    distance_[orphan] = best + 1;
    return;
  }
  for (int d = 0; d < int(steps_.size()); ++d) {
    const NodeId next = Next(orphan, d);
    if (tree_[next] != tree_[orphan]) continue;
    if (Inward(orphan, d) > 0) Activate(next);
    if (parent_[next] < kOrphan && Next(next, parent_[next]) == orphan) MakeOrphan(next);
  }
  tree_[orphan] = kFree;
  parent_[orphan] = kNoParent;
}

int64_t LatticeCut::Solve() {
  for (NodeId node = 1; node < NodeId(terminal_.size()); ++node) {
    if (terminal_[node] == 0) continue;
    tree_[node] = terminal_[node] > 0 ? kSource : kSink;
    parent_[node] = kTerminal;
    Activate(node);
  }
  NodeId node = 0, meeting = 0;
  int direction = 0;
  while (NextActive(node)) {
    while (tree_[node] != kFree && Grow(node, meeting, direction)) {
      ++time_;
      Augment(meeting, direction);
      for (size_t n = 0; n < orphans_.size(); ++n) Adopt(orphans_[n]);
      orphans_.clear();
    }
  }
  return flow_;
}

}  // namespace kvx
