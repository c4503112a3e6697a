// The true motion of one pose, both ways: rigid in bones and their cartilage, the elastic solid elsewhere,
// blended into the bone's motion over the last millimetres where tissue grows on bone. Rendering and truth
// points use this one map.
#pragma once
#include <optional>

#include "pipeline/phantom/motion/posed_body.h"
#include "pipeline/phantom/motion/tet_locator.h"

namespace kvx::phantom {

struct MaterialPoint {
  Eigen::Vector3d rest = Eigen::Vector3d::Zero();  // where it is in the template
  int bone = -1;                                   // that it moves rigidly with, -1: soft
};

// Keeps references to everything it is given.
class CompositeMotion {
 public:
  CompositeMotion(const Anatomy& anatomy, const BoneFields& fields, const DistanceGrid& skin,
                  const TetMesh& mesh, const BodyModel::Posed& posed);

  // Template to posed, mm. Nothing where there is neither solid nor bone.
  std::optional<Eigen::Vector3d> Forward(const Eigen::Vector3d& rest) const;
  // What lies at a place of the posed body: bone before tissue, tissue before the air around it. Nothing: air
  // or a joint's gap.
  std::optional<MaterialPoint> Inverse(const Eigen::Vector3d& posed) const;
  // Over that at rest; not above 0 where the map turns tissue inside out. Nothing as in Forward.
  std::optional<double> VolumeRatio(const Eigen::Vector3d& rest) const;
  // How deep below both skins soft tissue lies in other soft tissue; 0 where it has its place for itself.
  double SharedDepthMm(const Eigen::Vector3d& rest) const;
  // The bone that carries a template point rigidly, -1: none.
  int Carrier(const Eigen::Vector3d& rest) const;

 private:
  struct Hold {  // how much of a rest point's motion is the nearest bone's own, 0 to 1
    int bone = -1;
    double distance_mm = kFarMm, share = 0;
  };
  struct Local {  // the map at a rest point, and what it is made of
    Hold hold;
    int tet = -1;  // -1: the bone's motion alone
    Eigen::Vector3d by_bone = Eigen::Vector3d::Zero(), by_solid = Eigen::Vector3d::Zero(),
                    posed = Eigen::Vector3d::Zero();
  };
  Hold HoldAt(const Eigen::Vector3d& rest) const;
  Eigen::Vector3d HoldSlope(const Eigen::Vector3d& rest) const;
  std::optional<Local> At(const Eigen::Vector3d& rest) const;
  Eigen::Matrix3d SlopeOf(const Eigen::Vector3d& rest, const Local& local) const;
  std::optional<Local> Closer(const Eigen::Vector3d& posed, const Local& local, Eigen::Vector3d& rest) const;
  std::optional<MaterialPoint> BoneAt(const Eigen::Vector3d& posed) const;
  std::optional<MaterialPoint> SoftFrom(const Eigen::Vector3d& posed, Eigen::Vector3d rest) const;

  const Anatomy& anatomy_;
  const BoneFields& fields_;
  const DistanceGrid& skin_;
  const TetMesh& mesh_;
  const BodyModel::Posed& posed_;
  std::vector<RigidTransform> template_from_posed_;  // of every bone
  std::vector<Box> bone_boxes_;                      // posed
  TetLocator locator_;
  double blend_mm_;
};

}  // namespace kvx::phantom
