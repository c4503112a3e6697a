// The synthetic body: bones, joints, muscles and cords as shapes in the template's anatomy frame (mm).
// Anatomy frame: the NIfTI world of the files we write (RAS+). Knee: +x anterior, +y up the leg, +z lateral.
// Hand: +x thumb side, +y distal, +z dorsal. LPS appears where volumes leave through pipeline/io.
#pragma once
#include <string>
#include <vector>

#include "core/study.h"
#include "pipeline/phantom/anatomy/signed_distance.h"
#include "pipeline/phantom/random.h"

namespace kvx::phantom {

enum class Tissue : uint8_t {
  kAir,
  kSkin,
  kSubcutaneousFat,
  kMuscle,
  kTendon,
  kCortical,
  kMarrow,
  kCartilage,
  kVessel,
  kDeepFat,
  kCapsule
};
constexpr int kTissueCount = 11;
const char* NameOf(Tissue tissue);

struct PhantomBone {
  std::string name;
  int parent = -1;  // index; parents come first
  Shape shape;
  double cortex_shaft_mm = 3;  // cortical thickness at the middle of the long axis ...
  double cortex_end_mm = 1;    // ... and at its ends
};

struct PhantomAxis {
  std::string name;           // "flex", "abd", "axial"
  Eigen::Vector3d direction;  // unit, template, neutral pose
};

struct PhantomJoint {
  int child = 0, parent = 0;
  Eigen::Vector3d centre;
  std::vector<PhantomAxis> axes;  // first one outermost
  bool bends = true;              // false: moves by a few degrees only
  // Around the flexion axis the parent's surface is cartilage over which soft tissue slides instead of
  // sticking to it.
  double slip_radius_mm = 0, slip_half_width_mm = 0;
};

// Muscles contract along `fibre` in proportion to the angle of the joint that drives them.
struct PhantomMuscle {
  std::string name;
  Shape shape;
  Eigen::Vector3d fibre;  // unit
  std::string driver;     // bone whose flexion it serves; empty: passive
  double activation_at_90_deg = 0;
};

// Tendons, ligaments and vessels.
struct PhantomCord {
  Tissue tissue = Tissue::kTendon;
  Shape shape;
};

struct Anatomy {
  Region region = Region::kKnee;
  Shape body;  // the skin
  std::vector<PhantomBone> bones;
  std::vector<PhantomJoint> joints;
  std::vector<PhantomMuscle> muscles;
  std::vector<PhantomCord> cords;
  double skin_mm = 1.5, fat_mm = 6, cartilage_mm = 1.6;
  double cell_mm = 6;           // of the elastic solid
  double distance_step_mm = 1;  // of sampled bone distances

  const PhantomJoint* JointOf(int child) const;
  // 0: soft tissue grows onto this bone here; 1: it slides over it (see PhantomJoint::slip_radius_mm).
  double Slip(int bone, const Eigen::Vector3d& x) const;
  // The bone with its articular cartilage: what moves rigidly. Signed distance, mm.
  double RigidDistance(int bone, const Eigen::Vector3d& x) const;
};

Anatomy MakeKnee(uint64_t seed);
Anatomy MakeHand(uint64_t seed);

}  // namespace kvx::phantom
