// The knee: femur, tibia, fibula, patella, the muscles of thigh and calf. x anterior, y up the leg, z
// lateral, origin in the joint.
#include "pipeline/phantom/anatomy/anatomy.h"

namespace kvx::phantom {
namespace {

using V = Eigen::Vector3d;
constexpr double kHalfLengthMm = 200;  // of the modelled leg: longer than any field of view

// Proportions drawn per seed, as factors of the drawn values below.
struct Proportions {
  double bone, girth, calf, fat;
  double quadriceps, hamstrings;
};

Proportions Draw(Random& random) {
  return {random.Uniform(0.94, 1.06), random.Uniform(0.94, 1.06), random.Uniform(0.92, 1.08),
          random.Uniform(0.8, 1.25),  random.Uniform(0.92, 1.08), random.Uniform(0.92, 1.08)};
}

void CutToLeg(Shape& shape) {
  shape.cut_low.y() = -kHalfLengthMm;
  shape.cut_high.y() = kHalfLengthMm;
}

void ScaleBone(Shape& shape,
               double factor) {  // about the joint; lengths along the leg do not matter, girths do
  for (RoundCone& c : shape.cones) {
    c.a *= factor, c.b *= factor;
    c.radius_a_mm *= factor, c.radius_b_mm *= factor;
  }
  for (Ellipsoid& e : shape.ellipsoids) e.centre *= factor, e.radii_mm *= factor;
}

Shape Femur() {
  return {{{V(16, 240, 2), V(13, 80, 0), 14, 14.5},
           {V(13, 80, 0), V(11, 38, 0), 14.5, 22},
           {V(10, 34, -12), V(7, 6, -21), 19, 17},
           {V(10, 34, 12), V(7, 6, 21), 19, 17},
           {V(15, 18, -13), V(17, 2, -15), 16, 13.5},  // trochlea, a groove between two lips
           {V(15, 18, 13), V(18, 2, 15), 16, 14}},
          {{V(5, 0, -24), V(25, 22.5, 12.5)}, {V(5, 0, 23), V(24.5, 22.5, 13)}},
          6};
}

Shape Tibia() {
  return {{{V(9, -46, -7), V(11, -80, -3), 25, 17.5},
           {V(9, -46, 8), V(11, -80, -3), 25, 17.5},
           {V(11, -80, -3), V(6, -240, -8), 17, 12},
           {V(25, -52, 1), V(27, -70, 2), 10, 8}},  // tuberosity
          {{V(6, -37, -22), V(24, 10, 17)}, {V(5, -37, 22), V(23, 10, 17)}, {V(7, -31, 0), V(9, 8, 8)}},
          7};
}

Shape Fibula() {
  return {{{V(-9, -56, 33), V(-8, -78, 33), 9, 6}, {V(-8, -78, 33), V(-6, -240, 27), 6, 6.5}}, {}, 4};
}

Shape Patella() { return {{{V(46, 12, 0), V(45, -8, 0), 8, 4.5}}, {{V(46.5, 13, 1), V(10, 19, 21)}}, 6}; }

std::vector<PhantomBone> Bones(const Proportions& p) {
  std::vector<PhantomBone> bones = {{"femur", -1, Femur(), 4.5, 1.3},
                                    {"tibia", 0, Tibia(), 4.0, 1.3},
                                    {"fibula", 1, Fibula(), 2.2, 1.0},
                                    {"patella", 0, Patella(), 1.6, 1.4}};
  for (PhantomBone& bone : bones) {
    ScaleBone(bone.shape, p.bone);
    CutToLeg(bone.shape);
  }
  return bones;
}

std::vector<PhantomJoint> Joints(const Proportions& p, Random& random) {
  const V flex = V(random.Normal(0.02), random.Normal(0.03), -1.0).normalized();
  return {
      {1, 0, V(5, 0, 0) * p.bone, {{"flex", flex}, {"axial", V::UnitY()}}, true, 31 * p.bone, 35 * p.bone},
      {2, 1, V(-8, -52, 31) * p.bone, {{"flex", -V::UnitZ()}}, false},
      {3, 0, V(15, 3, 0) * p.bone, {{"flex", -V::UnitZ()}}, true, 28 * p.bone, 26 * p.bone}};
}

Shape Skin(const Proportions& p) {
  const double g = p.girth, c = p.calf * p.girth;
  Shape skin{{{V(6, 260, 0), V(8, 120, 0), 72 * g, 62 * g},
              {V(8, 120, 0), V(8, 45, 0), 62 * g, 47 * g},
              {V(10, 30, -8), V(8, -40, -8), 43 * g, 41 * g},
              {V(10, 30, 8), V(8, -40, 8), 43 * g, 40 * g},
              {V(34, 22, 0), V(32, -4, 0), 28 * p.bone, 26 * p.bone},  // over the patella
              {V(16, -55, 2), V(14, -80, 0), 31 * g, 30 * g},          // over the tuberosity
              {V(-2, -50, 0), V(-12, -112, 0), 42 * c, 50 * c},
              {V(-12, -112, 0), V(-2, -260, 2), 50 * c, 30 * c}},
             {},
             22};
  CutToLeg(skin);
  return skin;
}

// A muscle belly from one tendon to the other: three balls joined by cones.
PhantomMuscle Belly(const char* name, const V& top, double top_r, const V& mid, double mid_r, const V& low,
                    double low_r, double activation) {
  // Neighbours press against each other: what overlaps becomes the septum between them
  constexpr double kFull = 1.15;
  PhantomMuscle muscle{name,
                       {{{top, mid, kFull * top_r, kFull * mid_r}, {mid, low, kFull * mid_r, low_r}}, {}, 8},
                       (low - top).normalized(),
                       "tibia",
                       activation};
  CutToLeg(muscle.shape);
  return muscle;
}

std::vector<PhantomMuscle> Muscles(const Proportions& p) {
  const double g = p.girth, q = p.quadriceps * g, h = p.hamstrings * g, c = p.calf * g;
  return {
      Belly("rectus_femoris", V(54, 250, 2), 19 * q, V(50, 130, 4), 16 * q, V(42, 55, 2), 6, -0.10),
      Belly("vastus_intermedius", V(36, 240, 4), 20 * q, V(34, 120, 3), 17 * q, V(34, 48, 1), 6, -0.10),
      Belly("vastus_lateralis", V(26, 240, 40), 25 * q, V(26, 120, 34), 22 * q, V(28, 42, 28), 7, -0.10),
      Belly("vastus_medialis", V(26, 230, -34), 20 * q, V(26, 100, -34), 22 * q, V(30, 36, -29), 9, -0.10),
      Belly("adductor_magnus", V(-8, 250, -34), 28 * g, V(-6, 150, -32), 20 * g, V(0, 60, -32), 6, 0.02),
      Belly("sartorius", V(16, 240, -60), 9 * g, V(-10, 110, -50), 9 * g, V(-22, 10, -37), 4, 0.2),
      Belly("gracilis", V(-12, 250, -56), 10 * g, V(-26, 110, -42), 8 * g, V(-28, 10, -33), 4, 0.2),
      Belly("semimembranosus", V(-30, 240, -18), 18 * h, V(-34, 110, -20), 19 * h, V(-32, 25, -22), 8, 0.2),
      Belly("semitendinosus", V(-48, 240, -10), 14 * h, V(-46, 120, -10), 12 * h, V(-36, 40, -16), 5, 0.2),
      Belly("biceps_femoris", V(-42, 240, 18), 20 * h, V(-38, 110, 22), 19 * h, V(-26, 15, 33), 7, 0.22),
      Belly("gastrocnemius_med", V(-28, 12, -20), 8, V(-36, -80, -21), 20 * c, V(-34, -170, -8), 9, 0.18),
      Belly("gastrocnemius_lat", V(-28, 12, 18), 8, V(-36, -75, 19), 18 * c, V(-32, -160, 6), 8, 0.18),
      Belly("soleus", V(-16, -60, 8), 9, V(-18, -130, 2), 25 * c, V(-20, -240, 0), 13, 0.02),
      Belly("popliteus", V(-16, -28, 14), 5, V(-16, -50, -2), 8, V(-10, -85, -14), 5, 0.1),
      Belly("tibialis_anterior", V(20, -62, 22), 8, V(18, -120, 17), 14 * c, V(12, -240, 8), 9, 0.02),
      Belly("peroneus", V(2, -66, 40), 6, V(0, -120, 38), 10 * c, V(-4, -240, 30), 9, 0.02)};
}

PhantomCord Cord(Tissue tissue, const V& a, const V& b, double radius_a_mm, double radius_b_mm) {
  PhantomCord cord{tissue, {{{a, b, radius_a_mm, radius_b_mm}}, {}, 0}};
  CutToLeg(cord.shape);
  return cord;
}

std::vector<PhantomCord> Cords(const Proportions& p) {
  std::vector<PhantomCord> cords;
  const double s = p.bone;
  for (const double z : {-8.0, -3.0, 2.0, 7.0}) {  // patellar tendon and quadriceps tendon: broad and flat
    cords.push_back(Cord(Tissue::kTendon, s * V(47, -6, z * 0.7), s * V(34, -66, z * 0.6 + 1), 2.6, 2.6));
    cords.push_back(Cord(Tissue::kTendon, s * V(47, 28, z), s * V(44, 75, z * 0.8 + 1), 3.0, 2.2));
  }
  cords.push_back(Cord(Tissue::kTendon, s * V(14, -28, -1), s * V(-4, 6, 8), 3.5, 3.5));  // anterior cruciate
  cords.push_back(
      Cord(Tissue::kTendon, s * V(-12, -32, 0), s * V(10, 0, -7), 4.0, 4.0));  // posterior cruciate
  cords.push_back(
      Cord(Tissue::kTendon, s * V(6, 8, 39), s * V(-7, -50, 40), 2.2, 2.2));  // lateral collateral
  cords.push_back(
      Cord(Tissue::kTendon, s * V(6, 10, -39), s * V(10, -60, -30), 2.4, 2.4));        // medial collateral
  cords.push_back(Cord(Tissue::kTendon, V(-30, 30, -30), V(-6, -60, -28), 2.4, 2.4));  // semimembranosus
  cords.push_back(Cord(Tissue::kTendon, V(-26, 25, 35), V(-10, -52, 40), 2.8, 2.4));   // biceps
  cords.push_back(Cord(Tissue::kTendon, V(-34, -150, 0), V(-28, -240, 0), 3.0, 6.0));  // Achilles
  cords.push_back(Cord(Tissue::kVessel, V(-18, 230, -14), V(-36, 20, 2), 4.2, 3.8));   // popliteal artery
  cords.push_back(Cord(Tissue::kVessel, V(-36, 20, 2), V(-28, -60, 4), 3.8, 3.2));
  cords.push_back(Cord(Tissue::kVessel, V(-26, 230, -12), V(-43, 20, 6), 4.6, 4.0));  // popliteal vein
  cords.push_back(Cord(Tissue::kVessel, V(-43, 20, 6), V(-34, -60, 6), 4.0, 3.4));
  cords.push_back(Cord(Tissue::kVessel, V(-8, 230, -62), V(-30, 0, -36), 2.2, 2.2));  // great saphenous vein
  return cords;
}

}  // namespace

Anatomy MakeKnee(uint64_t seed) {
  Random random(seed, "knee anatomy");
  const Proportions p = Draw(random);
  Anatomy knee;
  knee.region = Region::kKnee;
  knee.body = Skin(p);
  knee.bones = Bones(p);
  knee.joints = Joints(p, random);
  knee.muscles = Muscles(p);
  knee.cords = Cords(p);
  knee.skin_mm = random.Uniform(1.6, 2.2);
  knee.fat_mm = 6.5 * p.fat;
  knee.cartilage_mm = random.Uniform(1.6, 2.0);
  knee.cell_mm = 6.0;
  knee.distance_step_mm = 1.25;
  return knee;
}

}  // namespace kvx::phantom
