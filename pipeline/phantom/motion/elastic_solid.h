// Quasi-static equilibrium of a hyperelastic, nearly incompressible solid whose bones are moved: stable
// neo-Hookean energy (Smith et al. 2018, without the logarithm), contracting fibres, limited-memory BFGS
// preconditioned by the rest Laplacian. Knows nothing of skinning weights: bones enter as prescribed nodes
// only.
#pragma once
#include <memory>
#include <span>

#include "pipeline/phantom/motion/tet_mesh.h"

namespace kvx::phantom {

struct TetMaterial {
  double shear = 1;                                 // shear modulus mu, relative; 0: no solid here
  Eigen::Vector3d fibre = Eigen::Vector3d::Zero();  // unit, at rest; zero: none
};

// Two material points that may touch and slide, but not pass each other: the sum over nodes of weight *
// position is the way from the one to the other. The last two nodes are the other's.
struct SolidContact {
  std::array<int, 6> nodes{};
  std::array<double, 6> weights{};
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit
  double gap_mm = 0;                                 // along the normal where that sum is zero; < 0: overlap
};

// What acts on a solid beside its prescribed nodes; may be empty.
struct SolidLoad {
  std::span<const double>
      activation;  // per tetrahedron: tension along the fibre in units of its shear modulus
  std::span<const SolidContact> contacts;
};

struct SolidOptions {
  double bulk_ratio = 12;  // lambda / mu: Poisson's ratio 0.46; linear tetrahedra lock beyond
  // Root mean square force on a node, in units of mean shear modulus times cell area
  double tolerance = 2e-3;
  int max_iterations = 400;  // of one load step
  // Of a contact, per mm of overlap, in units of shear modulus 1 times the cell's edge
  double contact_stiffness = 10;
  int memory = 8;  // pairs that BFGS keeps
};

struct SettleReport {
  int iterations = 0;
  double residual = 0;  // in the units of the tolerance
};

class ElasticSolid {
 public:
  // `fixed`: 1 for nodes that bones carry. Materials are per tetrahedron.
  ElasticSolid(const TetMesh& mesh, std::vector<TetMaterial> materials, std::vector<uint8_t> fixed,
               const SolidOptions& options);
  ~ElasticSolid();

  // Moves the free nodes of `positions` (start values on entry) until forces balance. Thread-safe.
  SettleReport Settle(std::vector<Eigen::Vector3d>& positions, const SolidLoad& load) const;
  // Energy, and its gradient with respect to the nodes when `gradient` is given.
  double Energy(const std::vector<Eigen::Vector3d>& positions, const SolidLoad& load,
                std::vector<Eigen::Vector3d>* gradient) const;

 private:
  struct Preconditioner;
  double ContactEnergy(const std::vector<Eigen::Vector3d>& positions, std::span<const SolidContact> contacts,
                       std::vector<Eigen::Vector3d>* gradient) const;
  double Residual(const Eigen::VectorXd& gradient) const;
  void Gather(const std::vector<Eigen::Vector3d>& from, Eigen::VectorXd& to) const;
  void Scatter(const Eigen::VectorXd& from, std::vector<Eigen::Vector3d>& to) const;

  const TetMesh& mesh_;
  std::vector<TetMaterial> materials_;
  std::vector<int> free_;  // nodes that may move
  SolidOptions options_;
  std::vector<uint8_t> loaded_;  // tetrahedra with a free node: the others never strain
  double force_unit_ = 1;
  std::unique_ptr<Preconditioner> preconditioner_;
};

// F: the gradient of the piecewise linear map that carries the rest mesh to `positions`.
Eigen::Matrix3d DeformationGradient(const TetMesh& mesh, const std::vector<Eigen::Vector3d>& positions,
                                    int tet);

}  // namespace kvx::phantom
