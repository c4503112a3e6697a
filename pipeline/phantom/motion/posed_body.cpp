// Materials, bone-carried nodes and load steps.
#include "pipeline/phantom/motion/posed_body.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace kvx::phantom {
namespace {

using Eigen::Vector3d;

constexpr double kStepDeg = 12;          // largest joint angle of one load step
constexpr double kShareInContact = 0.5;  // of such a step, once tissue meets tissue
constexpr double kMuscleShear = 1.6, kTendonShear = 4, kSkinShear = 2.5;  // fat = 1
constexpr double kJointShear = 0.15;  // fluid and folds between the bones of a joint
constexpr int kContactRounds = 4;
constexpr double kOverlapCells = 0.05;  // that may remain

int FingerOf(const Anatomy& anatomy, int bone) {  // index of the chain's first bone under the root
  while (bone > 0 && anatomy.bones[size_t(bone)].parent > 0) bone = anatomy.bones[size_t(bone)].parent;
  return bone;
}

int NearestByShape(const Anatomy& anatomy, const Vector3d& x) {
  int nearest = 0;
  double least = 1e9;
  for (size_t b = 0; b < anatomy.bones.size(); ++b) {
    const double d = anatomy.bones[b].shape.Distance(x);
    if (d < least) least = d, nearest = int(b);
  }
  return nearest;
}

TetMesh BodyMesh(const Anatomy& anatomy) {
  MeshDomain domain{anatomy.body.Bounds(), [&](const Vector3d& x) { return anatomy.body.Distance(x); }, {}};
  if (anatomy.region == Region::kHand) {
    domain.branch = [&](const Vector3d& x) { return FingerOf(anatomy, NearestByShape(anatomy, x)); };
  }
  return MakeTetMesh(domain, anatomy.cell_mm);
}

int MuscleAt(const Anatomy& anatomy, const Vector3d& x) {
  int found = -1;
  double least = 0;
  for (size_t m = 0; m < anatomy.muscles.size(); ++m) {
    const double d = anatomy.muscles[m].shape.Distance(x);
    if (d < least) least = d, found = int(m);
  }
  return found;
}

bool InTendon(const Anatomy& anatomy, const Vector3d& x, double within_mm) {
  return std::any_of(anatomy.cords.begin(), anatomy.cords.end(), [&](const PhantomCord& cord) {
    return cord.tissue == Tissue::kTendon && cord.shape.Distance(x) < within_mm;
  });
}

// Distance to the second nearest bone: small in a joint's gap.
double SecondBone(const BoneFields& fields, const Vector3d& x) {
  double first = kFarMm, second = kFarMm;
  for (int b = 0; b < fields.size(); ++b) {
    const double d = fields.Distance(b, x);
    second = std::min(second, std::max(first, d));
    first = std::min(first, d);
  }
  return second;
}

bool WithinOneBone(const TetMesh& mesh, const std::vector<int>& inside, int tet) {
  const std::array<int, 4>& n = mesh.tets[size_t(tet)];
  const int bone = inside[size_t(n[0])];
  return bone >= 0 && std::all_of(n.begin(), n.end(), [&](int node) { return inside[size_t(node)] == bone; });
}

// And those of `before` whose place is not among the places of `found`.
std::vector<SolidContact> WithThoseLost(std::vector<SolidContact> found,
                                        const std::vector<SolidContact>& before) {
  const auto place = [](const SolidContact& contact) {
    return std::pair(contact.nodes[4], contact.nodes[5]);
  };
  std::set<std::pair<int, int>> places;
  for (const SolidContact& contact : found) places.insert(place(contact));
  std::copy_if(before.begin(), before.end(), std::back_inserter(found),
               [&](const SolidContact& contact) { return !places.contains(place(contact)); });
  return found;
}

}  // namespace

BodyModel::BodyModel(const Anatomy& anatomy, const BoneFields& fields, const SolidOptions& options)
    : anatomy_(anatomy),
      fields_(fields),
      mesh_(BodyMesh(anatomy)),
      contact_(mesh_, [&](const Vector3d& x) { return anatomy.body.Distance(x); }) {
  const std::vector<int> inside = AttachNodes();
  std::vector<uint8_t> fixed(mesh_.nodes.size(), 0);
  for (size_t n = 0; n < fixed.size(); ++n) fixed[n] = carrier_[n] >= 0;
  std::vector<TetMaterial> materials(mesh_.tets.size());
  muscle_of_.assign(mesh_.tets.size(), -1);
  counts_.assign(mesh_.tets.size(), 0);
  for (size_t t = 0; t < mesh_.tets.size(); ++t) {
    const Vector3d x = mesh_.Centroid(int(t));
    const double skin = anatomy.body.Distance(x);
    muscle_of_[t] = MuscleAt(anatomy, x);
    TetMaterial& material = materials[t];
    if (muscle_of_[t] >= 0) {
      material = {kMuscleShear, anatomy.muscles[size_t(muscle_of_[t])].fibre};
    } else if (InTendon(anatomy, x, 0.3 * mesh_.cell_mm)) {
      material.shear = kTendonShear;
    } else if (skin > -anatomy.skin_mm - 0.25 * mesh_.cell_mm) {
      material.shear = kSkinShear * std::clamp(0.5 - skin / mesh_.cell_mm, 0.1,
                                               1.0);  // cubes cut by the skin are part air
    }
    if (SecondBone(fields, x) < mesh_.cell_mm) material.shear = kJointShear;
    if (WithinOneBone(mesh_, inside, int(t))) material.shear = 0;
    const NearestBone nearest = fields.Nearest(x);
    counts_[t] = skin < 0 && nearest.distance_mm > 0 && material.shear > 0;
  }
  solid_ = std::make_unique<ElasticSolid>(mesh_, std::move(materials), std::move(fixed), options);
}

// Bones carry the nodes that lie in them, but for the slip zones: there the solid only reaches into the bone,
// without hold. Returns the bone that each node lies in, -1: none.
std::vector<int> BodyModel::AttachNodes() {
  std::vector<int> inside(mesh_.nodes.size(), -1);
  carrier_.assign(mesh_.nodes.size(), -1);
  for (size_t n = 0; n < mesh_.nodes.size(); ++n) {
    const NearestBone nearest = fields_.Nearest(mesh_.nodes[n]);
    if (nearest.distance_mm < 0) inside[n] = nearest.bone;
    const bool slides = nearest.bone >= 0 && anatomy_.Slip(nearest.bone, mesh_.nodes[n]) > 0.5;
    if (nearest.distance_mm < 0.25 * mesh_.cell_mm && !slides) carrier_[n] = nearest.bone;
  }
  std::vector<uint8_t> in_solid(mesh_.nodes.size(), 0);
  for (size_t t = 0; t < mesh_.tets.size(); ++t) {
    if (WithinOneBone(mesh_, inside, int(t))) continue;
    for (const int n : mesh_.tets[t]) in_solid[size_t(n)] = 1;
  }
  for (size_t n = 0; n < mesh_.nodes.size(); ++n) {
    if (!in_solid[n]) carrier_[n] = inside[n];
  }
  return inside;
}

Vector3d BodyModel::Guess(const Vector3d& rest, const std::vector<RigidTransform>& motions) const {
  Vector3d sum = Vector3d::Zero();
  double total = 0;
  for (size_t b = 0; b < motions.size(); ++b) {
    const double d = std::max(anatomy_.bones[b].shape.Distance(rest), 0.1), weight = 1.0 / (d * d * d * d);
    sum += weight * Move(motions[b], rest);
    total += weight;
  }
  return sum / total;
}

std::vector<double> BodyModel::Activation(const PhantomPose& pose) const {
  std::vector<double> per_muscle;
  for (const PhantomMuscle& muscle : anatomy_.muscles) {
    const auto driver = pose.angles_deg.find(muscle.driver);
    const double flex = driver == pose.angles_deg.end() ? 0 : driver->second.at("flex");
    per_muscle.push_back(2.0 * muscle.activation_at_90_deg * std::clamp(flex / 90.0, 0.0, 1.0));
  }
  std::vector<double> activation(mesh_.tets.size(), 0);
  for (size_t t = 0; t < activation.size(); ++t) {
    if (muscle_of_[t] >= 0) activation[t] = per_muscle[size_t(muscle_of_[t])];
  }
  return activation;
}

BodyModel::Posed BodyModel::Pose(const PhantomPose& pose, const Progress& progress) const {
  Posed posed;
  posed.nodes = mesh_.nodes;
  posed.posed_from_template = BoneMotions(anatomy_, pose, 0);
  const std::vector<double> full = Activation(pose);
  const double step = 1 / std::max(1.0, std::ceil(LargestJointAngleDeg(pose) / kStepDeg));
  bool in_contact = false;  // from then on steps are shorter
  for (double share = pose.index == 0 ? 1 : 0; share < 1;) {
    progress.Report("phantom: soft tissue", share);
    const double reach = share + (in_contact ? kShareInContact * step : step);
    const double next = reach > 1 - 1e-9 ? 1 : reach;
    Posed moved = posed;
    Carry(BoneMotions(anatomy_, pose, next), moved);
    std::vector<double> activation = full;
    for (double& a : activation) a *= next;
    const bool again = SettleInContact(activation, moved) && !in_contact;  // it met other tissue just now
    in_contact |= again;
    if (again) continue;
    share = next;
    posed = std::move(moved);
    ++posed.steps;
  }
  MeasureStrain(posed);
  return posed;
}

// Where the next step starts: bones where they are then, and the last equilibrium carried along by them.
void BodyModel::Carry(std::vector<RigidTransform> motions, Posed& posed) const {
  for (size_t n = 0; n < mesh_.nodes.size(); ++n) {
    const Vector3d& rest = mesh_.nodes[n];
    if (carrier_[n] >= 0)
      posed.nodes[n] = Move(motions[size_t(carrier_[n])], rest);
    else
      posed.nodes[n] += Guess(rest, motions) - Guess(rest, posed.posed_from_template);
  }
  posed.posed_from_template = std::move(motions);
}

// Contacts are looked for again where the last ones have left the tissue. Those of places that lie in nothing
// any more stay, or the places would go back. Returns whether there are any.
bool BodyModel::SettleInContact(std::span<const double> activation, Posed& posed) const {
  std::vector<SolidContact> contacts = contact_.Find(posed.nodes);
  for (int round = 0; round < kContactRounds; ++round) {
    const SettleReport report = solid_->Settle(posed.nodes, {activation, contacts});
    posed.iterations += report.iterations;
    posed.residual = report.residual;
    std::vector<SolidContact> found = contact_.Find(posed.nodes);
    posed.overlap_mm = OverlapMm(found);
    contacts = WithThoseLost(std::move(found), contacts);
    if (posed.overlap_mm <= kOverlapCells * mesh_.cell_mm) break;
  }
  return !contacts.empty();
}

void BodyModel::MeasureStrain(Posed& posed) const {
  size_t inverted = 0, total = 0;
  for (size_t t = 0; t < mesh_.tets.size(); ++t) {
    if (!counts_[t]) continue;
    const double j = DeformationGradient(mesh_, posed.nodes, int(t)).determinant();
    inverted += j <= 0;
    ++total;
    posed.jacobian_low = std::min(posed.jacobian_low, j);
    posed.jacobian_high = std::max(posed.jacobian_high, j);
  }
  posed.inverted_share = total ? double(inverted) / double(total) : 0.0;
}

}  // namespace kvx::phantom
