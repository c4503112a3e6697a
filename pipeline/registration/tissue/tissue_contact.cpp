// Nodes are sorted into cells of space; whoever finds a node of another side beside itself is inside it as
// far as that node's own depth says.
#include "pipeline/registration/tissue/tissue_contact.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <optional>

#include "core/host/parallel.h"
#include "core/voxels/distance_transform.h"

namespace kvx {
namespace {

using Eigen::Matrix3f, Eigen::Vector3f, Eigen::Vector3i;

constexpr float kOtherSideSpacings = 4;  // at rest, between nodes that can meet
constexpr float kDeepestSpacings = 3;    // that one push takes back
constexpr float kFirmness = 100;         // of a contact, over tissue's stiffness per node
constexpr float kCrushed = 0.05f;        // volume over that at rest, below which a normal says nothing
constexpr int kRounds = 10;
constexpr double kMostCells = 1 << 26;
constexpr uint32_t kNoCell = std::numeric_limits<uint32_t>::max();
constexpr size_t kNodesOfAPart = 1 << 12;  // that one thread looks at

float MeanSpacing(const ElasticLattice& lattice) { return float(lattice.rest_spacing_mm.mean()); }

// Nodes with tissue by where they are now.
class Cells {
 public:
  explicit Cells(const ElasticLattice& lattice) : lattice_(lattice), width_mm_(MeanSpacing(lattice)) {
    const auto [low, high] = ParallelSum<Bounds>(lattice.kinds.size(), [&](Bounds& so_far, size_t n) {
      const Vector3f& mm = lattice.positions_mm[n];
      if (lattice.kinds[n] != NodeKind::kAbsent) so_far += mm.allFinite() ? Bounds{mm, mm} : Bounds::All();
    });
    if (!(low.array() <= high.array()).all()) return;      // no tissue
    low_mm_ = low - Vector3f::Constant(1.5f * width_mm_);  // every node has cells around its own
    const Eigen::Vector3d wide = ((high - low_mm_) / width_mm_).cast<double>().array() + 2;
    if (!(wide.prod() <= kMostCells)) return;
    size_ = wide.cast<int>();
    SortNodes();
  }

  // Nothing to be found: no tissue, or tissue torn over a space that no body fills.
  bool Empty() const { return nodes_.empty(); }
  // The node within a cell's width of node `n` that is nearest to it among those far from it at rest.
  std::optional<size_t> OtherSide(size_t n) const {
    std::optional<size_t> found;
    float nearest = width_mm_ * width_mm_;
    const Vector3f mm = lattice_.positions_mm[n];
    const Vector3i cell = CellOf(mm), home = lattice_.NodeAt(n);
    for (int d = 0; d < 9; ++d) {  // three cells along x lie side by side
      const size_t middle = Index(cell + Vector3i(0, d % 3 - 1, d / 3 - 1));
      for (uint32_t at = first_[middle - 1]; at < first_[middle + 2]; ++at) {
        const Node& other = nodes_[at];
        const float squared = (other.mm - mm).squaredNorm();
        if (squared >= nearest || !FarAtRest(home, other.home)) continue;
        nearest = squared, found = other.index;
      }
    }
    return found;
  }

 private:
  struct Bounds {
    Vector3f low = Vector3f::Constant(std::numeric_limits<float>::max()), high = -low;
    static Bounds All() { return {Bounds().high, Bounds().low}; }
    Bounds& operator+=(const Bounds& other) {
      low = low.cwiseMin(other.low), high = high.cwiseMax(other.high);
      return *this;
    }
  };
  struct Node {
    Vector3f mm;
    Vector3i home;  // in the lattice
    uint32_t index;
  };

  // Calls visit(n) for every node whose cell is one of a part, part beside part.
  template <class F>
  void ForEachInParts(const std::vector<uint32_t>& cells, F&& visit) const {
    constexpr size_t kParts = 2;  // each looks at all nodes: the places that they go to are what takes time
    const size_t share = first_.size() / kParts + 1;
    ParallelFor(kParts, [&](size_t part) {
      const size_t begin = part * share, end = std::min(begin + share, first_.size());
      for (size_t n = 0; n < cells.size(); ++n)
        if (cells[n] >= begin && cells[n] < end) visit(n);
    });
  }
  void SortNodes() {
    const size_t count = lattice_.kinds.size();
    std::vector<uint32_t> cells(count);  // of nodes without tissue none
    ParallelEach(count, [&](size_t n) {
      const bool absent = lattice_.kinds[n] == NodeKind::kAbsent;
      cells[n] = absent ? kNoCell : uint32_t(Index(CellOf(lattice_.positions_mm[n])));
    });
    first_.assign(size_.cast<size_t>().prod() + 1, 0);
    ForEachInParts(cells, [&](size_t n) { ++first_[cells[n] + 1]; });
    for (size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    nodes_.resize(first_.back());
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    ForEachInParts(cells, [&](size_t n) {
      nodes_[next[cells[n]]++] = {lattice_.positions_mm[n], lattice_.NodeAt(n), uint32_t(n)};
    });
  }
  Vector3i CellOf(const Vector3f& mm) const { return ((mm - low_mm_) / width_mm_).cast<int>(); }
  size_t Index(const Vector3i& c) const {
    return (size_t(c.z()) * size_t(size_.y()) + size_t(c.y())) * size_t(size_.x()) + size_t(c.x());
  }
  bool FarAtRest(const Vector3i& a, const Vector3i& b) const {
    const float far = kOtherSideSpacings * width_mm_;
    return (a - b).cast<float>().cwiseProduct(lattice_.rest_spacing_mm.cast<float>()).squaredNorm() >=
           far * far;
  }

  const ElasticLattice& lattice_;
  float width_mm_;
  Vector3f low_mm_ = Vector3f::Zero();
  Vector3i size_ = Vector3i::Zero();
  std::vector<uint32_t> first_;  // of each cell among the nodes, and their number
  std::vector<Node> nodes_;      // by cell
};

// d(position) / d(rest) about a node, along the lattice's axes; nothing where it has no neighbour along one.
std::optional<Matrix3f> Gradient(const ElasticLattice& lattice, size_t n) {
  const Vector3i node = lattice.NodeAt(n);
  Matrix3f out;
  for (int axis = 0; axis < 3; ++axis) {
    const auto neighbour = [&](int sign) {
      const Vector3i p = node + sign * Vector3i::Unit(axis);
      if (p[axis] < 0 || p[axis] >= lattice.size[axis]) return n;
      const size_t at = lattice.Index(p.x(), p.y(), p.z());
      return lattice.kinds[at] == NodeKind::kAbsent ? n : at;
    };
    const size_t before = neighbour(-1), after = neighbour(1);
    const int apart = (lattice.NodeAt(after) - lattice.NodeAt(before))[axis];
    if (apart == 0) return std::nullopt;
    out.col(axis) = (lattice.positions_mm[after] - lattice.positions_mm[before]) /
                    (float(apart) * float(lattice.rest_spacing_mm[axis]));
  }
  return out;
}

// The holds that a lattice has, and pushes beside them.
class Held {
 public:
  explicit Held(const ElasticLattice& lattice)
      : holds_(lattice.positions_mm.size(), Matrix3f::Zero()), mm_(lattice.positions_mm) {
    ParallelEach(lattice.holds.empty() ? 0 : holds_.size(), [&](size_t n) { LetGo(lattice, n); });
  }
  const std::vector<Matrix3f>& holds() const { return holds_; }
  const std::vector<Vector3f>& mm() const { return mm_; }  // says nothing where nothing holds

  // In the place of the pushes before.
  void Push(const ElasticLattice& lattice, const std::vector<ContactPush>& pushes) {
    for (const uint32_t node : pushed_) LetGo(lattice, node);
    pushed_.clear();
    const float firmness = kFirmness / (MeanSpacing(lattice) * MeanSpacing(lattice));
    for (const ContactPush& push : pushes) {
      pushed_.push_back(push.node);
      const Vector3f touching = lattice.positions_mm[push.node] + push.mm * push.normal;
      const Matrix3f contact = firmness * push.normal * push.normal.transpose();
      Matrix3f& hold = holds_[push.node];
      // One place that pulls as both would; across the normal without other holds nothing pulls.
      const Vector3f pull = hold * (mm_[push.node] - touching);
      hold += contact;
      const Matrix3f invertible = hold + 1e-5f * firmness * Matrix3f::Identity();
      mm_[push.node] = touching + invertible.llt().solve(pull);
    }
  }

 private:
  // What the lattice itself holds.
  void LetGo(const ElasticLattice& lattice, size_t n) {
    if (lattice.holds.empty()) return void(holds_[n].setZero());
    holds_[n] = lattice.HoldOf(lattice.NodeAt(n)), mm_[n] = lattice.held_mm[n];
  }

  std::vector<Matrix3f> holds_;
  std::vector<Vector3f> mm_;
  std::vector<uint32_t> pushed_;
};

}  // namespace

TissueContact::TissueContact(const Mask& air) : depth_mm_(DistanceMapMm(air)) {
  const float half_voxel_mm = 0.5f * float(air.grid.MeanSpacingMm());  // from a voxel's centre to its surface
  for (float& depth : depth_mm_.values) depth -= half_voxel_mm;
}

float TissueContact::DepthMm(const Vector3i& voxel) const {
  const Vector3i p = depth_mm_.grid.Nearest(voxel);
  return depth_mm_(p.x(), p.y(), p.z());
}

Vector3f TissueContact::DepthSlope(const Vector3i& voxel, int step) const {
  Vector3f slope;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3i along = step * Vector3i::Unit(axis);
    slope[axis] = (DepthMm(voxel + along) - DepthMm(voxel - along)) /
                  (2 * float(step) * float(depth_mm_.grid.spacing_mm[axis]));
  }
  return slope;
}

std::vector<ContactPush> TissueContact::Find(const ElasticLattice& lattice, int step) const {
  const Cells cells(lattice);
  if (cells.Empty()) return {};
  const float deepest_mm = kDeepestSpacings * MeanSpacing(lattice);
  const auto find = [&](std::vector<ContactPush>& found, size_t n) {
    if (lattice.kinds[n] != NodeKind::kFree) return;
    // What lies above a deeper one meets the other side first; beside a joint, tissue that is squeezed or
    // slides along bone comes as near to tissue from far away, and shares no space with it
    if (DepthMm(step * lattice.NodeAt(n)) > deepest_mm) return;
    const std::optional<size_t> other = cells.OtherSide(n);
    const auto gradient = other ? Gradient(lattice, *other) : std::nullopt;
    if (!gradient || std::abs(gradient->determinant()) < kCrushed) return;
    const Vector3i voxel = step * lattice.NodeAt(*other);
    const Vector3f inwards = gradient->inverse().transpose() * DepthSlope(voxel, step);
    const float slope = inwards.norm();  // of the depth at rest along a way in the scan
    if (slope < 0.1f) return;
    const Vector3f normal = -inwards / slope;
    const Vector3f off_mm = lattice.positions_mm[n] - lattice.positions_mm[*other];
    const float inside_mm = DepthMm(voxel) / slope - normal.dot(off_mm);
    if (inside_mm > 0) found.push_back({uint32_t(n), normal, 0.5f * std::min(inside_mm, deepest_mm)});
  };
  const size_t count = lattice.kinds.size(), parts = (count + kNodesOfAPart - 1) / kNodesOfAPart;
  return ParallelCollect<ContactPush>(parts, [&](std::vector<ContactPush>& found, size_t part) {
    for (size_t n = part * kNodesOfAPart; n < std::min(count, (part + 1) * kNodesOfAPart); ++n)
      find(found, n);
  });
}

void RelaxInContact(const ElasticSweeps& relax, const TissueContact& contact, int step, int sweeps,
                    const Progress& progress, ElasticLattice& lattice) {
  progress.ThrowIfCancelled();
  const auto prepared = relax.Prepare(lattice);
  std::vector<ContactPush> pushes = contact.Find(lattice, step);
  if (pushes.empty()) {
    relax(*prepared, lattice, sweeps);
    pushes = contact.Find(lattice, step);
  }
  if (pushes.empty()) return;
  const auto holds = lattice.holds;
  const auto held_mm = lattice.held_mm;
  const int hold_nodes = lattice.hold_nodes;
  Held held(lattice);
  for (int round = 0; round < kRounds && !pushes.empty(); ++round) {
    progress.ThrowIfCancelled();
    held.Push(lattice, pushes);
    lattice.holds = held.holds(), lattice.held_mm = held.mm(), lattice.hold_nodes = 1;
    relax(*prepared, lattice, std::max(1, 2 * sweeps / kRounds));
    lattice.holds = holds, lattice.held_mm = held_mm, lattice.hold_nodes = hold_nodes;
    pushes = contact.Find(lattice, step);
  }
}

}  // namespace kvx
