// Frames are named by their node and an octant:
// the three edges from the node towards the octant's neighbours.
#include "pipeline/registration/elastic_relaxation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>

#include "core/parallel.h"

namespace kvx {
namespace {

// Over-relaxation of the sweeps: smooth errors settle in a third of the sweeps.
constexpr float kOverRelaxation = 1.6f;

using Node = Eigen::Vector3i;

struct Frame {
  Eigen::Matrix3f f, cofactors;
  float determinant = 1;
};

class Frames {
 public:
  explicit Frames(const ElasticLattice& lattice)
      : lattice_(lattice),
        per_mm_(lattice.rest_spacing_mm.cwiseInverse().cast<float>()),
        strides_{1, lattice.size.x(), int64_t(lattice.size.x()) * lattice.size.y()} {}

  Eigen::Vector3f per_mm() const { return per_mm_; }

  // Whether the frame of `node` in the octant (one sign per axis) has all its nodes.
  bool Has(const Node& node, const int* signs) const {
    const size_t at = lattice_.Index(node.x(), node.y(), node.z());
    if (lattice_.kinds[at] == NodeKind::kAbsent) return false;
    for (int a = 0; a < 3; ++a) {
      const int p = node[a] + signs[a];
      if (p < 0 || p >= lattice_.size[a] || lattice_.kinds[at + signs[a] * strides_[a]] == NodeKind::kAbsent)
        return false;
    }
    return true;
  }

  // Of tissue when all three edges are.
  float Stiffness(const Node& node, const int* signs) const {
    const size_t at = lattice_.Index(node.x(), node.y(), node.z());
    for (int a = 0; a < 3; ++a) {
      const size_t lower = signs[a] > 0 ? at : at - strides_[a];
      if (!(lattice_.joined[lower] >> a & 1)) return lattice_.air_stiffness;
    }
    if (lattice_.stiffness.empty()) return 1;
    float most = lattice_.stiffness[at];
    for (int a = 0; a < 3; ++a) most = std::max(most, lattice_.stiffness[at + signs[a] * strides_[a]]);
    return most;
  }

  Frame At(const Node& node, const int* signs) const {
    const size_t at = lattice_.Index(node.x(), node.y(), node.z());
    const auto& x = lattice_.positions_mm;
    Frame out;
    for (int a = 0; a < 3; ++a)
      out.f.col(a) = (x[at + signs[a] * strides_[a]] - x[at]) * (signs[a] * per_mm_[a]);
    if (lattice_.handedness < 0) out.f.col(2) *= -1;
    out.cofactors.col(0) = out.f.col(1).cross(out.f.col(2));
    out.cofactors.col(1) = out.f.col(2).cross(out.f.col(0));
    out.cofactors.col(2) = out.f.col(0).cross(out.f.col(1));
    out.determinant = out.f.col(0).dot(out.cofactors.col(0));
    return out;
  }

 private:
  const ElasticLattice& lattice_;
  Eigen::Vector3f per_mm_;
  std::array<int64_t, 3> strides_;
};

// Gradient and Hessian of the energy in one node's position.
struct Local {
  float volume_stiffness = 1;
  Eigen::Vector3f gradient = Eigen::Vector3f::Zero();
  Eigen::Matrix3f second = Eigen::Matrix3f::Zero();  // of the volume and the hold
  float shear = 0;

  // The node's position enters the frame as f += shift * weights^T.
  void Add(const Frame& frame, const Eigen::Vector3f& weights, float stiffness) {
    const Eigen::Vector3f slope = frame.cofactors * weights;  // of the determinant
    const float pressure = volume_stiffness * (frame.determinant - 1) - 1;
    gradient += stiffness * (frame.f * weights + pressure * slope);
    second += (stiffness * volume_stiffness) * slope * slope.transpose();
    shear += stiffness * weights.squaredNorm();
  }
  void Add(const Eigen::Matrix3f& hold, const Eigen::Vector3f& off_mm) {
    gradient += hold * off_mm;
    second += hold;
  }
  Eigen::Vector3f Step() const {
    const Eigen::Matrix3f hessian = second + shear * Eigen::Matrix3f::Identity();
    return -hessian.llt().solve(gradient);
  }
};

void Visit(ElasticLattice& lattice, const Frames& frames, const Node& node) {
  const size_t at = lattice.Index(node.x(), node.y(), node.z());
  const Eigen::Vector3f flip(1, 1, lattice.handedness < 0 ? -1 : 1);
  Local local{lattice.volume_stiffness};
  for (int octant = 0; octant < 8; ++octant) {
    const int signs[3] = {octant & 1 ? 1 : -1, octant & 2 ? 1 : -1, octant & 4 ? 1 : -1};
    const Eigen::Vector3f edges =
        Eigen::Vector3f(signs[0], signs[1], signs[2]).cwiseProduct(frames.per_mm()).cwiseProduct(flip);
    if (frames.Has(node, signs)) local.Add(frames.At(node, signs), -edges, frames.Stiffness(node, signs));
    // The neighbour along axis a, whose frame looks back along a and on along the other two.
    for (int a = 0; a < 3; ++a) {
      Node other = node;
      other[a] += signs[a];
      if (other[a] < 0 || other[a] >= lattice.size[a]) continue;
      int back[3] = {signs[0], signs[1], signs[2]};
      back[a] = -signs[a];
      if (!frames.Has(other, back)) continue;
      const Eigen::Vector3f weights = -edges[a] * Eigen::Vector3f::Unit(a);
      local.Add(frames.At(other, back), weights, frames.Stiffness(other, back));
    }
  }
  if (!lattice.holds.empty()) local.Add(lattice.HoldOf(node), lattice.positions_mm[at] - lattice.held_mm[at]);
  if (local.shear > 0) lattice.positions_mm[at] += kOverRelaxation * local.Step();
}

}  // namespace

void Relax(ElasticLattice& lattice, int sweeps) {
  std::vector<uint32_t> all(lattice.kinds.size());
  std::iota(all.begin(), all.end(), 0);
  Relax(lattice, sweeps, all);
}

void Relax(ElasticLattice& lattice, int sweeps, std::span<const uint32_t> nodes) {
  const Frames frames(lattice);
  const auto node_at = [&](size_t at) {
    const size_t row = at / lattice.size.x();
    return Node(int(at % lattice.size.x()), int(row % lattice.size.y()), int(row / lattice.size.y()));
  };
  std::array<std::vector<uint32_t>, 8> colours;
  for (const uint32_t n : nodes) {
    if (lattice.kinds[n] != NodeKind::kFree) continue;
    const Node node = node_at(n);
    colours[(node.x() & 1) + 2 * (node.y() & 1) + 4 * (node.z() & 1)].push_back(n);
  }
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (const std::vector<uint32_t>& colour : colours) {
      ParallelRanges(colour.size(), [&](size_t begin, size_t end) {
        for (size_t n = begin; n < end; ++n) Visit(lattice, frames, node_at(colour[n]));
      });
    }
  }
}

double ElasticEnergy(const ElasticLattice& lattice) {
  const Frames frames(lattice);
  double sum = 0;
  for (size_t at = 0; at < lattice.kinds.size(); ++at) {
    const size_t row = at / lattice.size.x();
    const Node node(int(at % lattice.size.x()), int(row % lattice.size.y()), int(row / lattice.size.y()));
    if (!lattice.holds.empty()) {
      const Eigen::Vector3f off_mm = lattice.positions_mm[at] - lattice.held_mm[at];
      sum += 0.5 * off_mm.dot(lattice.HoldOf(node) * off_mm);
    }
    for (int octant = 0; octant < 8; ++octant) {
      const int signs[3] = {octant & 1 ? 1 : -1, octant & 2 ? 1 : -1, octant & 4 ? 1 : -1};
      if (!frames.Has(node, signs)) continue;
      const Frame frame = frames.At(node, signs);
      const double change = frame.determinant - 1;
      sum += frames.Stiffness(node, signs) *
             (0.5 * (frame.f.squaredNorm() - 3) - change + 0.5 * lattice.volume_stiffness * change * change);
    }
  }
  return sum;
}

}  // namespace kvx
