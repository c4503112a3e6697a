// Energy, forces and the solver. Columns of F are edge vectors of the walk, which makes forces differences of
// stress columns.
#include "pipeline/phantom/motion/elastic_solid.h"

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <deque>

namespace kvx::phantom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

Matrix3d Cofactor(const Matrix3d& f) {
  Matrix3d c;
  c.col(0) = f.col(1).cross(f.col(2));
  c.col(1) = f.col(2).cross(f.col(0));
  c.col(2) = f.col(0).cross(f.col(1));
  return c;
}

// Two-loop recursion over the last steps and gradient changes.
class Memory {
 public:
  explicit Memory(int capacity) : capacity_(size_t(capacity)) {}

  void Add(VectorXd step, VectorXd change) {
    const double product = step.dot(change);
    if (product <= 1e-12 * step.norm() * change.norm()) return;  // no positive curvature: nothing to learn
    pairs_.push_back({std::move(step), std::move(change), product});
    if (pairs_.size() > capacity_) pairs_.pop_front();
  }

  // About minus the inverse Hessian times the gradient; `precondition` is the inverse Hessian's first guess.
  template <class Precondition>
  VectorXd Direction(const VectorXd& gradient, const Precondition& precondition) const {
    VectorXd q = -gradient;
    std::vector<double> alpha(pairs_.size());
    for (size_t i = pairs_.size(); i-- > 0;) {
      alpha[i] = pairs_[i].step.dot(q) / pairs_[i].product;
      q -= alpha[i] * pairs_[i].change;
    }
    VectorXd r = precondition(q);
    if (!pairs_.empty()) {
      const Pair& last = pairs_.back();
      r *= last.product / last.change.dot(precondition(last.change));
    }
    for (size_t i = 0; i < pairs_.size(); ++i) {
      r += (alpha[i] - pairs_[i].change.dot(r) / pairs_[i].product) * pairs_[i].step;
    }
    return r;
  }

  void Clear() { pairs_.clear(); }

 private:
  struct Pair {
    VectorXd step, change;
    double product;
  };
  size_t capacity_;
  std::deque<Pair> pairs_;
};

}  // namespace

// The rest Laplacian of the free nodes, factored once; the same for x, y and z.
struct ElasticSolid::Preconditioner {
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor;

  Preconditioner(const TetMesh& mesh, const std::vector<TetMaterial>& materials,
                 const std::vector<int>& free) {
    std::vector<int> row_of(mesh.nodes.size(), -1);
    for (size_t i = 0; i < free.size(); ++i) row_of[free[i]] = int(i);
    std::vector<Eigen::Triplet<double>> entries;
    for (size_t t = 0; t < mesh.tets.size(); ++t) {
      for (int edge = 0; edge < 3; ++edge) {  // the gradient couples neighbours on the walk only
        const double k = materials[t].shear * mesh.cell_mm / 6.0;
        const int a = row_of[mesh.tets[t][edge]], b = row_of[mesh.tets[t][edge + 1]];
        if (a >= 0) entries.emplace_back(a, a, k);
        if (b >= 0) entries.emplace_back(b, b, k);
        if (a >= 0 && b >= 0) entries.emplace_back(a, b, -k), entries.emplace_back(b, a, -k);
      }
    }
    Eigen::SparseMatrix<double> laplacian(Eigen::Index(free.size()), Eigen::Index(free.size()));
    laplacian.setFromTriplets(entries.begin(), entries.end());
    factor.compute(laplacian);
  }

  VectorXd operator()(const VectorXd& v) const {
    const Eigen::Map<const Eigen::MatrixX3d> columns(v.data(), v.size() / 3, 3);
    VectorXd out(v.size());
    Eigen::Map<Eigen::MatrixX3d>(out.data(), v.size() / 3, 3) = factor.solve(columns);
    return out;
  }
};

ElasticSolid::ElasticSolid(const TetMesh& mesh, std::vector<TetMaterial> materials,
                           std::vector<uint8_t> fixed, const SolidOptions& options)
    : mesh_(mesh), materials_(std::move(materials)), options_(options), loaded_(mesh.tets.size(), 0) {
  for (size_t n = 0; n < mesh.nodes.size(); ++n) {
    if (!fixed[n]) free_.push_back(int(n));
  }
  double shear = 0, volume = 0;
  for (size_t t = 0; t < mesh.tets.size(); ++t) {
    if (materials_[t].shear <= 0) continue;
    for (const int n : mesh.tets[t]) loaded_[t] |= uint8_t(!fixed[n]);
    if (loaded_[t]) shear += materials_[t].shear, volume += 1;
  }
  force_unit_ = (volume > 0 ? shear / volume : 1.0) * mesh.cell_mm * mesh.cell_mm;
  preconditioner_ = std::make_unique<Preconditioner>(mesh, materials_, free_);
}

ElasticSolid::~ElasticSolid() = default;

Matrix3d DeformationGradient(const TetMesh& mesh, const std::vector<Vector3d>& positions, int tet) {
  Matrix3d f;
  const std::array<int, 4>& n = mesh.tets[tet];
  for (int s = 0; s < 3; ++s) {
    f.col(kWalks[mesh.walks[tet]][s]) = (positions[n[s + 1]] - positions[n[s]]) / mesh.cell_mm;
  }
  return f;
}

double ElasticSolid::ContactEnergy(const std::vector<Vector3d>& positions,
                                   std::span<const SolidContact> contacts,
                                   std::vector<Vector3d>* gradient) const {
  const double stiffness = options_.contact_stiffness * mesh_.cell_mm;
  double energy = 0;
  for (const SolidContact& contact : contacts) {
    double gap = contact.gap_mm;
    for (size_t n = 0; n < contact.nodes.size(); ++n)
      gap += contact.weights[n] * contact.normal.dot(positions[size_t(contact.nodes[n])]);
    if (gap >= 0) continue;
    energy += 0.5 * stiffness * gap * gap;
    if (!gradient) continue;
    for (size_t n = 0; n < contact.nodes.size(); ++n)
      (*gradient)[size_t(contact.nodes[n])] += stiffness * gap * contact.weights[n] * contact.normal;
  }
  return energy;
}

double ElasticSolid::Energy(const std::vector<Vector3d>& positions, const SolidLoad& load,
                            std::vector<Vector3d>* gradient) const {
  const double volume = mesh_.cell_mm * mesh_.cell_mm * mesh_.cell_mm / 6.0;
  const double area = volume / mesh_.cell_mm, ratio = options_.bulk_ratio, rest = 1.0 + 1.0 / ratio;
  if (gradient) gradient->assign(positions.size(), Vector3d::Zero());
  double energy = 0;
  for (size_t t = 0; t < mesh_.tets.size(); ++t) {
    if (!loaded_[t]) continue;
    const Matrix3d f = DeformationGradient(mesh_, positions, int(t)), cofactor = Cofactor(f);
    const double j = f.col(0).dot(cofactor.col(0)), mu = materials_[t].shear,
                 active = load.activation.empty() ? 0 : load.activation[t];
    const Vector3d stretched = f * materials_[t].fibre;
    energy += volume * mu * 0.5 *
              (f.squaredNorm() - 3.0 + ratio * (j - rest) * (j - rest) + active * stretched.squaredNorm());
    if (!gradient) continue;
    const Matrix3d stress =
        mu * (f + ratio * (j - rest) * cofactor + active * stretched * materials_[t].fibre.transpose());
    for (int s = 0; s < 3; ++s) {
      const Vector3d pull = area * stress.col(kWalks[mesh_.walks[t]][s]);
      (*gradient)[mesh_.tets[t][s]] -= pull;
      (*gradient)[mesh_.tets[t][s + 1]] += pull;
    }
  }
  return energy + ContactEnergy(positions, load.contacts, gradient);
}

void ElasticSolid::Gather(const std::vector<Vector3d>& from, VectorXd& to) const {
  const size_t n = free_.size();
  to.resize(Eigen::Index(3 * n));
  for (size_t i = 0; i < n; ++i) {
    for (int axis = 0; axis < 3; ++axis) to[Eigen::Index(axis * n + i)] = from[free_[i]][axis];
  }
}

void ElasticSolid::Scatter(const VectorXd& from, std::vector<Vector3d>& to) const {
  const size_t n = free_.size();
  for (size_t i = 0; i < n; ++i) {
    for (int axis = 0; axis < 3; ++axis) to[free_[i]][axis] = from[Eigen::Index(axis * n + i)];
  }
}

double ElasticSolid::Residual(const VectorXd& gradient) const {
  return gradient.norm() / std::sqrt(std::max<double>(1.0, double(free_.size()))) / force_unit_;
}

SettleReport ElasticSolid::Settle(std::vector<Vector3d>& positions, const SolidLoad& load) const {
  if (free_.empty()) return {};
  std::vector<Vector3d> forces;
  VectorXd x, g, next_g;
  Gather(positions, x);
  double energy = Energy(positions, load, &forces);
  Gather(forces, g);
  Memory memory(options_.memory);
  SettleReport report;
  for (; report.iterations < options_.max_iterations && Residual(g) > options_.tolerance;
       ++report.iterations) {
    VectorXd direction = memory.Direction(g, *preconditioner_);
    double slope = direction.dot(g), length = 1.0;
    if (slope >= 0) memory.Clear(), direction = -(*preconditioner_)(g), slope = direction.dot(g);
    double next_energy = energy;
    for (; length > 1e-6; length *= 0.5) {  // backtracking until the energy falls enough (Armijo)
      Scatter(x + length * direction, positions);
      next_energy = Energy(positions, load, &forces);
      if (next_energy <= energy + 1e-4 * length * slope) break;
    }
    if (length <= 1e-6) break;  // at the limit of the arithmetic
    Gather(forces, next_g);
    memory.Add(length * direction, next_g - g);
    x += length * direction;
    g.swap(next_g);
    energy = next_energy;
  }
  Scatter(x, positions);
  report.residual = Residual(g);
  return report;
}

}  // namespace kvx::phantom
