// The hand: carpals with the ends of the forearm, 19 finger bones, palm muscles, tendons. x thumb side, y
// distal, z dorsal.
#include <array>

#include "pipeline/phantom/anatomy/anatomy.h"

namespace kvx::phantom {
namespace {

using V = Eigen::Vector3d;

constexpr double kJointGapMm = 1.9;   // between bone surfaces, filled by two layers of cartilage
constexpr double kWristEndMm = -128;  // where the modelled forearm ends, beyond any field of view

// One ray of the hand from the wrist to the finger tip.
struct Ray {
  std::string name;
  V root, knuckle;  // base of the metacarpal, centre of its head
  std::array<double, 3>
      lengths;          // of the phalanges, from joint centre to joint centre, then to the tip; last 0: thumb
  V direction, dorsal;  // of the first phalanx; up from the nails
  std::array<double, 4> heads;  // radii of the heads: metacarpal, then phalanges (the last is the tuft)
  double girth;                 // of the finger at the middle joint
  std::vector<V> joints = {};   // centres: knuckle ... last joint, then the tip of the last bone
  std::vector<V> along = {};    // unit, of each phalanx
};

std::vector<Ray> Rays(Random& random) {
  std::vector<Ray> rays = {{"thumb",
                            V(14, -69, 15),
                            V(40, -37, 2),
                            {27, 21, 0},
                            V(0.50, 0.75, -0.44),
                            V(0.68, -0.10, 0.70),
                            {6.2, 5.0, 3.2, 0},
                            9.6},
                           {"index",
                            V(3, -63, 22),
                            V(14, -5, 22),
                            {41, 24, 18},
                            V(0.13, 0.99, -0.05),
                            V::UnitZ(),
                            {6.4, 4.9, 4.0, 2.5},
                            8.4},
                           {"middle",
                            V(-7.5, -62, 23.5),
                            V(-7.2, -1, 23.5),
                            {44, 28, 19},
                            V(-0.01, 1, -0.05),
                            V::UnitZ(),
                            {6.5, 5.0, 4.1, 2.6},
                            8.5},
                           {"ring",
                            V(-17, -63, 22),
                            V(-27.5, -6, 21.5),
                            {41, 27, 19},
                            V(-0.14, 0.98, -0.05),
                            V(-0.12, 0, 1),
                            {6.0, 4.7, 3.9, 2.5},
                            8.0},
                           {"little",
                            V(-25, -64, 20),
                            V(-42, -16, 18.5),
                            {32, 20, 17},
                            V(-0.31, 0.94, -0.05),
                            V(-0.22, 0, 1),
                            {5.4, 4.2, 3.5, 2.3},
                            7.2}};
  for (Ray& ray : rays) {
    for (double& length : ray.lengths) length *= random.Uniform(0.96, 1.04);
    V u = ray.direction.normalized();
    const V side = ray.dorsal.cross(u).normalized();
    ray.dorsal = u.cross(side);
    ray.joints = {ray.knuckle};
    for (const double length : ray.lengths) {
      if (length <= 0) break;
      ray.along.push_back(u);
      ray.joints.push_back(ray.joints.back() + length * u);
      u = Eigen::AngleAxisd(RadFromDeg(6.0), side) *
          u;  // relaxed fingers curl a little; the far side of `side` is palmar
    }
  }
  return rays;
}

V FlexAxis(const V& along, const V& dorsal) { return -along.cross(dorsal).normalized(); }

// From a base that faces the head before it, over a slender shaft, to its own head at the next joint.
PhantomBone LongBone(const std::string& name, int parent, const V& base, double base_r, const V& head,
                     double head_r) {
  const double waist = 0.62 * std::min(base_r, head_r) + 0.5;
  const V near_base = 0.68 * base + 0.32 * head, near_head = 0.30 * base + 0.70 * head;
  return {name,
          parent,
          {{{base, near_base, base_r, waist},
            {near_base, near_head, waist, waist},
            {near_head, head, waist, head_r}},
           {},
           3},
          1.3,
          0.5};
}

PhantomBone Carpals() {
  PhantomBone bone{"carpals", -1, {}, 1.0, 0.7};
  bone.shape.blend_mm = 1.5;
  bone.shape.ellipsoids = {{V(13, -80, 17), V(6, 5.5, 6)},  {V(3, -73, 21), V(5.5, 5.5, 7)},
                           {V(-7, -74, 22), V(6, 7.5, 7)},  {V(-18, -75, 20), V(6.5, 6.5, 7)},
                           {V(9, -90, 16), V(6.5, 6, 7)},   {V(-4, -90, 20), V(7, 6.5, 8)},
                           {V(-17, -88, 20), V(6.5, 6, 7)}, {V(-18, -84, 11), V(4, 4.5, 4.5)}};
  bone.shape.cones = {{V(4, -108, 18), V(5, -150, 18), 9.5, 7.5},
                      {V(-2, -107, 19), V(2, -130, 18), 8.5, 7},
                      {V(-21, -110, 20), V(-18, -150, 20), 6.5, 5.5}};
  return bone;
}

struct Draft {  // grows ray by ray
  Anatomy hand;
  double gap = kJointGapMm;
};

void AddJoint(Draft& draft, int child, int parent, const V& centre, std::vector<PhantomAxis> axes, bool bends,
              double head_r) {
  draft.hand.joints.push_back(
      {child, parent, centre, std::move(axes), bends, bends ? head_r + 1.8 : 0.0, head_r + 2.5});
}

void AddRayBones(Draft& draft, const Ray& ray) {
  std::vector<PhantomBone>& bones = draft.hand.bones;
  const bool thumb = ray.name == "thumb";
  const V metacarpal = (ray.knuckle - ray.root).normalized();
  const V flex = FlexAxis(ray.along[0], ray.dorsal), abduct = -ray.dorsal;
  bones.push_back(LongBone("mc_" + ray.name, 0, ray.root + 6.5 * metacarpal, 5.6, ray.knuckle, ray.heads[0]));
  int parent = int(bones.size()) - 1;
  AddJoint(draft, parent, 0, ray.root, {{"flex", flex}, {"abd", abduct}}, thumb, 7.0);
  const std::array<const char*, 3> prefix =
      thumb ? std::array<const char*, 3>{"pp_", "dp_", ""} : std::array<const char*, 3>{"pp_", "mp_", "dp_"};
  for (size_t p = 0; p < ray.along.size(); ++p) {
    const V u = ray.along[p];
    const double head_before = ray.heads[p], base_r = 0.9 * head_before,
                 tip = p + 1 == ray.along.size() ? ray.heads[p + 1] : 0.0;
    const V base = ray.joints[p] + u * (head_before + draft.gap + base_r);
    bones.push_back(
        LongBone(prefix[p] + ray.name, parent, base, base_r, ray.joints[p + 1] - u * tip, ray.heads[p + 1]));
    const int child = int(bones.size()) - 1;
    std::vector<PhantomAxis> axes = {{"flex", FlexAxis(u, ray.dorsal)}};
    if (p == 0) axes.push_back({"abd", abduct});
    AddJoint(draft, child, parent, ray.joints[p], std::move(axes), true, head_before);
    parent = child;
  }
}

void AddRaySkin(Shape& skin, const Ray& ray, double girth) {
  const double g = ray.girth * girth;
  const V palmar = -ray.dorsal;
  const size_t last = ray.joints.size() - 1;
  for (size_t p = 0; p < last; ++p) {
    const double from = p == 0 ? 1.16 * g : (p == 1 ? g : 0.88 * g),
                 to = p == 0 ? g : (p == 1 && last > 2 ? 0.88 * g : 0.72 * g);
    const V shift = palmar * 0.12 * g;  // the pads are palmar of the bones
    skin.cones.push_back({ray.joints[p] + shift, ray.joints[p + 1] + shift, from, to});
  }
  const V deep = palmar * 4.5;
  skin.cones.push_back(
      {ray.root + deep, ray.knuckle + deep, 13.0 * girth, ray.name == "thumb" ? 11.5 * girth : 12.0 * girth});
}

Shape Skin(const std::vector<Ray>& rays, double girth) {
  Shape skin;
  skin.blend_mm = 7;
  for (const Ray& ray : rays) AddRaySkin(skin, ray, girth);
  skin.cones.push_back({V(8, -74, 16), V(6, -150, 18), 17.5 * girth, 19 * girth});
  skin.cones.push_back({V(-20, -74, 16), V(-18, -150, 18), 16.5 * girth, 18 * girth});
  skin.cones.push_back({V(-6, -74, 16), V(-6, -150, 19), 18 * girth, 19.5 * girth});
  skin.cones.push_back({V(-4, -60, 12), V(-6, -14, 12), 14 * girth, 12 * girth});  // the hollow of the palm
  skin.ellipsoids = {{V(24, -48, 3), V(15, 22, 14) * girth}, {V(-33, -46, 8), V(12, 26, 13) * girth}};
  skin.cut_low.y() = kWristEndMm;
  return skin;
}

PhantomMuscle Belly(const std::string& name, const V& a, const V& b, double radius_mm,
                    const std::string& driver, double activation) {
  const V middle = 0.5 * (a + b);
  return {name,
          {{{a, middle, 0.35 * radius_mm, radius_mm}, {middle, b, radius_mm, 0.35 * radius_mm}}, {}, 3},
          (b - a).normalized(),
          driver,
          activation};
}

std::vector<PhantomMuscle> Muscles(const std::vector<Ray>& rays, double girth) {
  const double g = girth;
  std::vector<PhantomMuscle> muscles = {
      Belly("abd_poll_brev", V(10, -74, 4), V(40, -36, -6), 7.5 * g, "pp_thumb", 0.25),
      Belly("flex_poll_brev", V(4, -68, 6), V(34, -38, -6), 6.5 * g, "pp_thumb", 0.25),
      Belly("opponens_poll", V(8, -74, 10), V(32, -46, 3), 6.5 * g, "mc_thumb", 0.25),
      Belly("adductor_poll", V(-5, -42, 14), V(36, -37, 2), 6.5 * g, "pp_thumb", 0.2),
      Belly("abd_dig_min", V(-24, -76, 10), V(-48, -18, 12), 6.5 * g, "pp_little", 0.25),
      Belly("flex_dig_min", V(-18, -72, 6), V(-40, -20, 7), 6.0 * g, "pp_little", 0.25),
      Belly("forearm_flexors", V(-8, -160, 8), V(-8, -98, 8), 10 * g, "", 0),
      Belly("forearm_extensors", V(-6, -170, 28), V(-8, -104, 29), 6 * g, "", 0)};
  for (size_t f = 1; f < rays.size(); ++f) {  // between neighbouring metacarpals, and thumb to index
    const Ray &a = rays[f - 1], &b = rays[f];
    const V low = V(0, 0, -2), start = 0.5 * (a.root + b.root) + V(0, 6, 0),
            end = f == 1 ? V(b.knuckle + V(8, -6, -2)) : V(0.5 * (a.knuckle + b.knuckle) + V(0, -4, 0));
    muscles.push_back(Belly("interosseus_" + std::to_string(f), start + low, end + low,
                            (f == 1 ? 7.5 : 5.0) * g, "pp_" + b.name, 0.22));
    const V palmar = V(4, 0, -12);
    muscles.push_back(Belly("lumbrical_" + std::to_string(f), b.root + palmar + V(0, 14, 0),
                            b.knuckle + palmar, 2.6 * g, "pp_" + b.name, 0.2));
  }
  return muscles;
}

PhantomCord Cord(Tissue tissue, const std::vector<V>& path, double radius_mm) {
  PhantomCord cord{tissue, {}};
  for (size_t i = 0; i + 1 < path.size(); ++i)
    cord.shape.cones.push_back({path[i], path[i + 1], radius_mm, radius_mm});
  cord.shape.cut_low.y() = kWristEndMm;
  return cord;
}

std::vector<PhantomCord> Cords(const std::vector<Ray>& rays) {
  std::vector<PhantomCord> cords;
  for (const Ray& ray : rays) {
    const V palmar = -ray.dorsal, side = ray.dorsal.cross(ray.along[0]).normalized();
    std::vector<V> flexor = {V(-6, -128, 7) + 0.2 * (ray.root - V(-7, -63, 20)), ray.root + palmar * 12},
                   extensor = {ray.root + ray.dorsal * 7.5};
    std::vector<V> left, right;
    for (size_t j = 0; j + 1 < ray.joints.size(); ++j) {
      flexor.push_back(ray.joints[j] + palmar * (ray.heads[j] + 2.0));
      extensor.push_back(ray.joints[j] + ray.dorsal * (ray.heads[j] + 0.9));
      left.push_back(ray.joints[j] + 0.55 * ray.girth * side + palmar * 0.5 * ray.girth);
      right.push_back(ray.joints[j] - 0.55 * ray.girth * side + palmar * 0.5 * ray.girth);
    }
    cords.push_back(Cord(Tissue::kTendon, flexor, 1.9));
    cords.push_back(Cord(Tissue::kTendon, extensor, 1.1));
    cords.push_back(Cord(Tissue::kVessel, left, 0.9));
    cords.push_back(Cord(Tissue::kVessel, right, 0.9));
  }
  cords.push_back(Cord(Tissue::kVessel,
                       {V(14, -128, 6), V(16, -90, 6), V(2, -50, 3), V(-22, -52, 3), V(-26, -128, 8)}, 1.3));
  cords.push_back(Cord(Tissue::kVessel, {V(0, -128, 34), V(-2, -80, 33), V(2, -30, 31)}, 1.2));
  return cords;
}

void Scale(Shape& shape, double factor) {
  for (RoundCone& c : shape.cones)
    c.a *= factor, c.b *= factor, c.radius_a_mm *= factor, c.radius_b_mm *= factor;
  for (Ellipsoid& e : shape.ellipsoids) e.centre *= factor, e.radii_mm *= factor;
}

void Scale(Anatomy& hand, double factor) {  // smaller and larger hands of the same build; cuts stay
  Scale(hand.body, factor);
  for (PhantomBone& bone : hand.bones) Scale(bone.shape, factor);
  for (PhantomMuscle& muscle : hand.muscles) Scale(muscle.shape, factor);
  for (PhantomCord& cord : hand.cords) Scale(cord.shape, factor);
  for (PhantomJoint& joint : hand.joints)
    joint.centre *= factor, joint.slip_radius_mm *= factor, joint.slip_half_width_mm *= factor;
}

}  // namespace

Anatomy MakeHand(uint64_t seed) {
  Random random(seed, "hand anatomy");
  const double size = random.Uniform(0.93, 1.04), girth = random.Uniform(0.95, 1.07);
  const std::vector<Ray> rays = Rays(random);
  Draft draft;
  Anatomy& hand = draft.hand;
  hand.region = Region::kHand;
  hand.bones = {Carpals()};
  hand.bones[0].shape.cut_low.y() = kWristEndMm;
  for (const Ray& ray : rays) AddRayBones(draft, ray);
  hand.body = Skin(rays, girth);
  hand.muscles = Muscles(rays, girth);
  hand.cords = Cords(rays);
  Scale(hand, size);
  hand.skin_mm = random.Uniform(1.1, 1.5);
  hand.fat_mm = random.Uniform(1.8, 3.0);
  hand.cartilage_mm = 0.7;
  hand.cell_mm = 2.6;
  hand.distance_step_mm = 0.5;
  return hand;
}

}  // namespace kvx::phantom
