// Pose lists of the two regions, drawn with jitter per seed, and forward kinematics.
#include "pipeline/phantom/motion/poses.h"

#include <algorithm>
#include <array>

namespace kvx::phantom {
namespace {

using Eigen::Vector3d;

struct KneePose {
  const char* name;
  double flex_deg;
  bool seen;
};
constexpr std::array<KneePose, 6> kKneePoses = {{{"flex25", 25, true},
                                                 {"flex50", 50, true},
                                                 {"flex80", 80, true},
                                                 {"flex12", 12, false},
                                                 {"flex37", 37, false},
                                                 {"flex65", 65, false}}};

// Flexion in degrees of MCP, PIP, DIP for index to little finger, spread (abduction) and the thumb's three
// joints.
struct HandPose {
  const char* name;
  bool seen;
  double fingers[4][3];
  double spread[4];
  double thumb[3], thumb_abduction;
};
const std::vector<HandPose>& HandPoses() {
  static const std::vector<HandPose> poses = {
      {"half_curl",
       true,
       {{35, 38, 18}, {35, 40, 19}, {32, 38, 20}, {32, 42, 21}},
       {1, 0, 0, -2},
       {5, 8, 12},
       4},
      {"fist",
       true,
       {{66, 72, 34}, {65, 72, 34}, {66, 70, 36}, {64, 70, 34}},
       {3, 0, -3, -6},
       {2, 10, 18},
       -4},
      {"spread", true, {{-4, 0, 0}, {-2, 0, 0}, {-2, 0, 0}, {-2, 0, 0}}, {8, 2, -5, -10}, {-12, -5, -5}, -6},
      {"pinch", true, {{40, 42, 22}, {16, 17, 8}, {10, 13, 6}, {7, 10, 5}}, {3, 0, 0, 0}, {11, 12, 15}, 5},
      {"index_bend", true, {{60, 57, 30}, {7, 7, 3}, {0, 0, 0}, {0, 0, 0}}, {-2, 0, 0, 0}, {0, 5, 5}, 1},
      {"middle_bend", true, {{6, 5, 2}, {54, 60, 32}, {13, 9, 4}, {0, 0, 0}}, {0, 0, 0, 0}, {0, 0, 0}, 0},
      {"hook", true, {{6, 70, 38}, {6, 72, 40}, {6, 70, 38}, {4, 70, 38}}, {0, 0, -1, -3}, {-4, 6, 9}, -1},
      {"table_top", true, {{40, 6, 3}, {42, 9, 4}, {41, 7, 4}, {42, 7, 3}}, {0, 0, 0, -2}, {6, 5, 7}, 8},
      {"ring_little",
       true,
       {{0, 0, 0}, {13, 12, 7}, {48, 60, 29}, {50, 60, 31}},
       {0, 0, 0, 0},
       {9, 22, 38},
       6},
      {"middle_ring",
       false,
       {{8, 7, 4}, {46, 57, 27}, {47, 54, 27}, {12, 14, 6}},
       {0, 1, -2, 0},
       {2, 5, 4},
       2},
      {"thumb_flex", false, {{5, 9, 4}, {5, 9, 4}, {5, 9, 4}, {7, 7, 3}}, {0, 0, 0, 0}, {11, 26, 42}, 8},
      {"graded",
       false,
       {{14, 17, 8}, {30, 35, 18}, {43, 49, 25}, {52, 56, 28}},
       {0, 0, 0, 0},
       {5, 10, 10},
       3},
      {"pointing",
       false,
       {{3, 7, 3}, {62, 68, 32}, {60, 68, 33}, {58, 68, 33}},
       {0, 1, -1, -6},
       {4, 14, 20},
       -2},
      {"loose_curl",
       false,
       {{22, 46, 29}, {22, 46, 29}, {20, 46, 29}, {19, 48, 29}},
       {0, 1, 0, -2},
       {0, 10, 20},
       6}};
  return poses;
}

// Angles repeat to about 3 % and 0.5 degrees when a person is asked for the same pose again.
double Jitter(double angle_deg, Random& random) {
  return angle_deg * (1.0 + random.Normal(0.03)) + random.Normal(angle_deg == 0 ? 0.2 : 0.5);
}

PhantomPose Rest() {
  PhantomPose rest;
  rest.name = "neutral";
  return rest;
}

PhantomPose MakeKneePose(const KneePose& drawn, Random& random) {
  PhantomPose pose;
  pose.name = drawn.name;
  pose.seen = drawn.seen;
  const double flex = Jitter(drawn.flex_deg, random);
  pose.angles_deg["tibia"] = {{"flex", flex}, {"axial", -0.055 * flex + random.Normal(0.4)}};
  pose.angles_deg["patella"] = {{"flex", flex * random.Uniform(0.84, 0.90)}};  // glides in the trochlea
  pose.angles_deg["fibula"] = {{"flex", 0.015 * flex}};
  return pose;
}

PhantomPose MakeHandPose(const HandPose& drawn, Random& random) {
  constexpr std::array<const char*, 4> kFingers = {"index", "middle", "ring", "little"};
  PhantomPose pose;
  pose.name = drawn.name;
  pose.seen = drawn.seen;
  for (int f = 0; f < 4; ++f) {
    const std::string finger = kFingers[size_t(f)];
    pose.angles_deg["pp_" + finger] = {{"flex", Jitter(drawn.fingers[f][0], random)},
                                       {"abd", Jitter(drawn.spread[f], random)}};
    pose.angles_deg["mp_" + finger] = {{"flex", Jitter(drawn.fingers[f][1], random)}};
    pose.angles_deg["dp_" + finger] = {{"flex", Jitter(drawn.fingers[f][2], random)}};
  }
  pose.angles_deg["mc_thumb"] = {{"flex", Jitter(drawn.thumb[0], random)},
                                 {"abd", Jitter(drawn.thumb_abduction, random)}};
  pose.angles_deg["pp_thumb"] = {{"flex", Jitter(drawn.thumb[1], random)}, {"abd", random.Normal(0.4)}};
  pose.angles_deg["dp_thumb"] = {{"flex", Jitter(drawn.thumb[2], random)}};
  pose.angles_deg["mc_ring"] = {
      {"flex", 0.065 * pose.angles_deg["pp_ring"]["flex"]}};  // the palm cups in a fist
  pose.angles_deg["mc_little"] = {{"flex", 0.12 * pose.angles_deg["pp_little"]["flex"]}};
  return pose;
}

// Joints are not perfect hinges, and nobody lies down the same way twice.
void AddImperfections(const Anatomy& anatomy, Random& random, PhantomPose& pose) {
  const bool hand = anatomy.region == Region::kHand;
  for (const PhantomJoint& joint : anatomy.joints) {
    const double scale = joint.bends ? 1.0 : 0.25;
    Twist twist;
    twist.head<3>() = random.NormalVector(RadFromDeg(hand ? 0.8 : 0.6) * scale);
    twist.tail<3>() = random.NormalVector((hand ? 0.2 : 0.3) * scale);
    pose.slop[anatomy.bones[size_t(joint.child)].name] = twist;
  }
  Twist lie;
  lie.head<3>() = random.NormalVector(RadFromDeg(3.0));
  lie.tail<3>() = random.NormalVector(3.0);
  pose.scan_from_posed = Exp(lie);
}

double AngleOf(const PhantomPose& pose, const std::string& bone, const std::string& axis) {
  const auto angles = pose.angles_deg.find(bone);
  if (angles == pose.angles_deg.end()) return 0;
  const auto angle = angles->second.find(axis);
  return angle == angles->second.end() ? 0 : angle->second;
}

RigidTransform About(const Vector3d& centre, const RigidTransform& motion) {
  return {motion.rotation, centre - motion.rotation * centre + motion.translation_mm};
}

}  // namespace

std::vector<PhantomPose> MakePoses(const Anatomy& anatomy, uint64_t seed) {
  Random random(seed, "poses");
  std::vector<PhantomPose> poses = {Rest()};
  if (anatomy.region == Region::kKnee) {
    for (const KneePose& drawn : kKneePoses) poses.push_back(MakeKneePose(drawn, random));
  } else {
    for (const HandPose& drawn : HandPoses()) poses.push_back(MakeHandPose(drawn, random));
  }
  for (size_t i = 1; i < poses.size(); ++i) {
    poses[i].index = int(i);
    AddImperfections(anatomy, random, poses[i]);
  }
  return poses;
}

std::vector<RigidTransform> BoneMotions(const Anatomy& anatomy, const PhantomPose& pose, double share) {
  std::vector<RigidTransform> motions(anatomy.bones.size());
  for (size_t b = 0; b < motions.size(); ++b) {
    if (anatomy.bones[b].parent >= 0) motions[b] = motions[size_t(anatomy.bones[b].parent)];
    const PhantomJoint* joint = anatomy.JointOf(int(b));
    if (!joint) continue;
    const std::string& name = anatomy.bones[b].name;
    for (const PhantomAxis& axis : joint->axes) {
      const double angle = share * RadFromDeg(AngleOf(pose, name, axis.name));
      motions[b] = motions[b] * RotationAbout(PointMm{joint->centre}, axis.direction, angle);
    }
    if (const auto slop = pose.slop.find(name); slop != pose.slop.end()) {
      motions[b] = motions[b] * About(joint->centre, Exp(share * slop->second));
    }
  }
  return motions;
}

double LargestJointAngleDeg(const PhantomPose& pose) {
  double largest = 0;
  for (const auto& [bone, angles] : pose.angles_deg) {
    for (const auto& [axis, angle] : angles) largest = std::max(largest, std::abs(angle));
  }
  return largest;
}

}  // namespace kvx::phantom
