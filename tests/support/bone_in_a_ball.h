// A ball of tissue around a rod of bone, without mechanics: tissue stays where it is and slides over the rod,
// which goes where a test says.
#pragma once
#include "pipeline/phantom/motion/composite_motion.h"

namespace kvx::testing_support {

class BoneInABall {
 public:
  static constexpr double kRadiusMm = 32;    // of the ball, around 0
  static constexpr double kRodMm = 8;        // the rod's radius, its ends 12 mm above and below 0, along z
  static constexpr double kPelletMm = 4;     // radius of a second bone, at rest
  static constexpr double kPelletAtMm = 22;  // along y

  explicit BoneInABall(const RigidTransform& rod) {
    posed_.posed_from_template = {rod, RigidTransform{}};
    posed_.nodes = mesh_.nodes;
  }
  phantom::CompositeMotion Motion() const { return {anatomy_, fields_, skin_, mesh_, posed_}; }
  const phantom::Anatomy& anatomy() const { return anatomy_; }

 private:
  using V = Eigen::Vector3d;
  static phantom::Anatomy Drawn() {
    phantom::Anatomy drawn;
    drawn.body.cones = {{V::Zero(), V::Zero(), kRadiusMm, kRadiusMm}};
    drawn.bones = {
        {"rod", -1, {{{V(0, 0, -12), V(0, 0, 12), kRodMm, kRodMm}}, {}, 0}},
        {"pellet", 0, {{{V(0, kPelletAtMm, 0), V(0, kPelletAtMm, 0), kPelletMm, kPelletMm}}, {}, 0}}};
    drawn.joints = {{1, 0, V::Zero(), {{"flex", V::UnitZ()}}, true, 15, 40}};
    drawn.cartilage_mm = 0;
    drawn.cell_mm = 5;
    return drawn;
  }
  double Skin(const V& x) const { return anatomy_.body.Distance(x); }

  phantom::Anatomy anatomy_ = Drawn();
  phantom::BoneFields fields_{anatomy_};
  phantom::TetMesh mesh_ = phantom::MakeTetMesh(
      {anatomy_.body.Bounds(), [this](const V& x) { return Skin(x); }, {}}, anatomy_.cell_mm);
  phantom::DistanceGrid skin_ =
      phantom::SampleDistance(anatomy_.body.Bounds().Grown(10), 1, [this](const V& x) { return Skin(x); });
  phantom::BodyModel::Posed posed_;
};

}  // namespace kvx::testing_support
