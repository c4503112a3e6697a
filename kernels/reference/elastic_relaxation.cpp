// Node by node on host threads. A frame is named by its node and an octant.
#include "kernels/reference/elastic_relaxation.h"

#include <algorithm>
#include <array>
#include <numeric>

#include <Eigen/Cholesky>

#include "core/host/parallel.h"

namespace kvx::reference {
namespace {

using Node = Eigen::Vector3i;

// Along each axis of a lattice.
struct Axes {
  explicit Axes(const ElasticLattice& lattice)
      : stretch(lattice.rest_spacing_mm.cwiseInverse().cast<float>()),
        strides{1, lattice.size.x(), int64_t(lattice.size.x()) * lattice.size.y()} {
    if (lattice.handedness < 0) stretch.z() *= -1;
  }
  Eigen::Vector3f stretch;  // of an edge, per mm; turns left-handed axes into right-handed ones
  std::array<int64_t, 3> strides;
};

// Gradient and Hessian of the energy in one node's position.
struct Local {
  float volume_stiffness = 1;
  Eigen::Vector3f gradient = Eigen::Vector3f::Zero();
  Eigen::Matrix3f second = Eigen::Matrix3f::Zero();  // of the volume and the hold; its lower half
  float shear = 0;

  // A frame f into which the node's position enters as f += shift * weights^T: f * weights, the slope of its
  // determinant, and that determinant.
  void Add(const Eigen::Vector3f& stretch, const Eigen::Vector3f& slope, float determinant,
           float weights_squared, float stiffness) {
    const float pressure = volume_stiffness * (determinant - 1) - 1;
    gradient += stiffness * (stretch + pressure * slope);
    const Eigen::Vector3f scaled = (stiffness * volume_stiffness) * slope;
    for (int column = 0; column < 3; ++column) {
      for (int row = column; row < 3; ++row) second(row, column) += scaled[row] * slope[column];
    }
    shear += stiffness * weights_squared;
  }
  void Add(const Eigen::Matrix3f& hold, const Eigen::Vector3f& off_mm) {
    gradient += hold * off_mm;
    second += hold;
  }
  Eigen::Vector3f Step() const {
    const Eigen::Matrix3f hessian = second + shear * Eigen::Matrix3f::Identity();
    return -hessian.llt().solve(gradient);  // reads the lower half
  }
};

// The side of each axis on which an octant lies: 0 before the node, 1 after it.
using Sides = std::array<int, 3>;
Sides SidesOf(int octant) { return {octant & 1, octant >> 1 & 1, octant >> 2 & 1}; }

// What the frames of a node share: the edges to its neighbours, relative to their length at rest. Only edges
// that are asked for are read: of a neighbour, the one that leads on ends at a node that may be moving.
class Edges {
 public:
  Edges(const ElasticLattice& lattice, const Axes& axes, const Node& node)
      : lattice_(lattice), axes_(axes), at_(lattice.Index(node.x(), node.y(), node.z())) {
    for (int a = 0; a < 3; ++a) {
      for (const int side : {0, 1}) {
        const int beside = node[a] + (side ? 1 : -1);
        if (beside < 0 || beside >= lattice.size[a]) continue;
        const size_t other = Beside(a, side);
        if (lattice.kinds[other] == NodeKind::kAbsent) continue;
        has_[a][side] = true;
        joined_[a][side] = lattice.joined[side ? at_ : other] >> a & 1;
        if (!lattice.stiffness.empty()) stiffness_[a][side] = lattice.stiffness[other];
      }
    }
  }
  bool Has(int axis, int side) const { return has_[axis][side]; }
  bool HasFrame(const Sides& sides) const {
    return has_[0][sides[0]] && has_[1][sides[1]] && has_[2][sides[2]];
  }
  Eigen::Vector3f operator()(int axis, int side) const {
    const Eigen::Vector3f edge = lattice_.positions_mm[Beside(axis, side)] - lattice_.positions_mm[at_];
    return edge * (side ? axes_.stretch[axis] : -axes_.stretch[axis]);
  }
  // Of the frame of edges to these sides: of tissue when all three are.
  float Stiffness(const Sides& sides) const {
    if (!joined_[0][sides[0]] || !joined_[1][sides[1]] || !joined_[2][sides[2]])
      return lattice_.air_stiffness;
    if (lattice_.stiffness.empty()) return 1;
    return std::max(
        {lattice_.stiffness[at_], stiffness_[0][sides[0]], stiffness_[1][sides[1]], stiffness_[2][sides[2]]});
  }

 private:
  size_t Beside(int axis, int side) const {
    return side ? at_ + axes_.strides[size_t(axis)] : at_ - axes_.strides[size_t(axis)];
  }
  const ElasticLattice& lattice_;
  const Axes& axes_;
  size_t at_;
  bool has_[3][2] = {}, joined_[3][2] = {};
  float stiffness_[3][2] = {};
};

// The frames that the node spans itself.
void AddOwn(const Edges& edges, const Eigen::Vector3f& stretch, Local& local) {
  for (int octant = 0; octant < 8; ++octant) {
    const Sides sides = SidesOf(octant);
    if (!edges.HasFrame(sides)) continue;
    const Eigen::Vector3f x = edges(0, sides[0]), y = edges(1, sides[1]), z = edges(2, sides[2]);
    Eigen::Vector3f weights;
    for (int a = 0; a < 3; ++a) weights[a] = sides[a] ? -stretch[a] : stretch[a];
    const Eigen::Vector3f yz = y.cross(z);
    const Eigen::Vector3f slope = weights[0] * yz + weights[1] * z.cross(x) + weights[2] * x.cross(y);
    local.Add(weights[0] * x + weights[1] * y + weights[2] * z, slope, x.dot(yz), weights.squaredNorm(),
              edges.Stiffness(sides));
  }
}

// The frames of the neighbour at a side of an axis that look back along it: only that edge moves.
void AddNeighbours(const Edges& around, int axis, int side, float stretch, Local& local) {
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  for (int pair = 0; pair < 4; ++pair) {
    Sides sides;
    sides[axis] = 1 - side, sides[b] = pair & 1, sides[c] = pair >> 1;
    if (!around.Has(b, sides[b]) || !around.Has(c, sides[c])) continue;
    const Eigen::Vector3f back = around(axis, sides[axis]);
    const Eigen::Vector3f cofactors = around(b, sides[b]).cross(around(c, sides[c]));
    const float weight = side ? -stretch : stretch;
    local.Add(weight * back, weight * cofactors, back.dot(cofactors), weight * weight,
              around.Stiffness(sides));
  }
}

void Visit(ElasticLattice& lattice, const Axes& axes, const Node& node) {
  const size_t at = lattice.Index(node.x(), node.y(), node.z());
  Local local{lattice.volume_stiffness};
  const Edges own(lattice, axes, node);
  AddOwn(own, axes.stretch, local);
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {0, 1}) {
      if (!own.Has(axis, side)) continue;
      Node other = node;
      other[axis] += side ? 1 : -1;
      AddNeighbours(Edges(lattice, axes, other), axis, side, axes.stretch[axis], local);
    }
  }
  if (!lattice.holds.empty()) local.Add(lattice.HoldOf(node), lattice.positions_mm[at] - lattice.held_mm[at]);
  if (local.shear > 0) lattice.positions_mm[at] += kElasticOverRelaxation * local.Step();
}

}  // namespace

void Relax(ElasticLattice& lattice, int sweeps) {
  std::vector<uint32_t> all(lattice.kinds.size());
  std::iota(all.begin(), all.end(), 0);
  Relax(lattice, sweeps, all);
}

void Relax(ElasticLattice& lattice, int sweeps, std::span<const uint32_t> nodes) {
  const Axes axes(lattice);
  std::array<std::vector<uint32_t>, 8> colours;
  for (const uint32_t n : nodes) {
    if (lattice.kinds[n] != NodeKind::kFree) continue;
    const Node node = lattice.NodeAt(n);
    colours[(node.x() & 1) + 2 * (node.y() & 1) + 4 * (node.z() & 1)].push_back(n);
  }
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (const std::vector<uint32_t>& colour : colours) {
      ParallelEach(colour.size(), [&](size_t n) { Visit(lattice, axes, lattice.NodeAt(colour[n])); });
    }
  }
}

double ElasticEnergy(const ElasticLattice& lattice) {
  const Axes axes(lattice);
  double sum = 0;
  for (size_t at = 0; at < lattice.kinds.size(); ++at) {
    const Node node = lattice.NodeAt(at);
    if (!lattice.holds.empty()) {
      const Eigen::Vector3f off_mm = lattice.positions_mm[at] - lattice.held_mm[at];
      sum += 0.5 * off_mm.dot(lattice.HoldOf(node) * off_mm);
    }
    if (lattice.kinds[at] == NodeKind::kAbsent) continue;
    const Edges edges(lattice, axes, node);
    for (int octant = 0; octant < 8; ++octant) {
      const Sides sides = SidesOf(octant);
      if (!edges.HasFrame(sides)) continue;
      const Eigen::Vector3f x = edges(0, sides[0]), y = edges(1, sides[1]), z = edges(2, sides[2]);
      const double change = x.dot(y.cross(z)) - 1;
      const double squared = x.squaredNorm() + y.squaredNorm() + z.squaredNorm();
      sum += edges.Stiffness(sides) *
             (0.5 * (squared - 3) - change + 0.5 * lattice.volume_stiffness * change * change);
    }
  }
  return sum;
}

}  // namespace kvx::reference
