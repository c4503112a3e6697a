// Runs the elastic solid for one pose: materials from the anatomy, bones in small steps, muscles contracting.
#pragma once
#include "core/host/progress.h"
#include "pipeline/phantom/anatomy/bone_fields.h"
#include "pipeline/phantom/motion/elastic_solid.h"
#include "pipeline/phantom/motion/poses.h"
#include "pipeline/phantom/motion/self_contact.h"

namespace kvx::phantom {

// What all poses share. Holds references: lives no longer than the anatomy and the fields.
class BodyModel {
 public:
  BodyModel(const Anatomy& anatomy, const BoneFields& fields, const SolidOptions& options);

  struct Posed {
    std::vector<RigidTransform> posed_from_template;  // of every bone
    std::vector<Eigen::Vector3d> nodes;               // of the mesh
    int steps = 0, iterations = 0;
    double residual = 0;        // of the last step, see SolidOptions::tolerance
    double inverted_share = 0;  // of the body's tetrahedra
    double jacobian_low = 1, jacobian_high = 1;
    double overlap_mm = 0;  // how deep tissue lies in other tissue, at most
  };
  Posed Pose(const PhantomPose& pose, const Progress& progress) const;

  const TetMesh& mesh() const { return mesh_; }
  // Where a start guess puts a point: bones blended by inverse square distance. Only a start, and a yardstick
  // for reports.
  Eigen::Vector3d Guess(const Eigen::Vector3d& rest, const std::vector<RigidTransform>& motions) const;

 private:
  std::vector<int> AttachNodes();
  std::vector<double> Activation(const PhantomPose& pose) const;
  void Carry(std::vector<RigidTransform> motions, Posed& posed) const;
  bool SettleInContact(std::span<const double> activation, Posed& posed) const;
  void MeasureStrain(Posed& posed) const;

  const Anatomy& anatomy_;
  const BoneFields& fields_;
  TetMesh mesh_;
  std::vector<int> carrier_;     // bone that carries a node, -1: free
  std::vector<int> muscle_of_;   // of each tetrahedron, -1: none
  std::vector<uint8_t> counts_;  // tetrahedra of soft body tissue: those that strain figures are about
  std::unique_ptr<ElasticSolid> solid_;
  SelfContact contact_;
};

}  // namespace kvx::phantom
