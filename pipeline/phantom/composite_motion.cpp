// Forward in closed form; inverse by a few Newton steps from the solid's own inverse.
#include "pipeline/phantom/composite_motion.h"

namespace kvx::phantom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Of a cell: the layer over which the solid gives way to the bone's own motion
constexpr double kBlendShare = 0.6;
constexpr double kInverseMm = 1e-4;  // how closely the inverse is solved

Box PosedBox(const Box& box, const RigidTransform& posed_from_template) {
  Box posed;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d x(corner & 1 ? box.high.x() : box.low.x(), corner & 2 ? box.high.y() : box.low.y(),
                     corner & 4 ? box.high.z() : box.low.z());
    posed.Add(Move(posed_from_template, x), Vector3d::Zero());
  }
  return posed;
}

}  // namespace

CompositeMotion::CompositeMotion(const Anatomy& anatomy, const BoneFields& fields, const DistanceGrid& skin,
                                 const TetMesh& mesh, const BodyModel::Posed& posed)
    : anatomy_(anatomy),
      fields_(fields),
      skin_(skin),
      mesh_(mesh),
      posed_(posed),
      locator_(mesh, posed.nodes),
      blend_mm_(kBlendShare * mesh.cell_mm) {
  for (int b = 0; b < fields.size(); ++b) {
    template_from_posed_.push_back(posed.posed_from_template[size_t(b)].Inverse());
    bone_boxes_.push_back(PosedBox(fields.grid(b).box, posed.posed_from_template[size_t(b)]));
  }
}

std::optional<CompositeMotion::Local> CompositeMotion::At(const Vector3d& rest) const {
  int bone = -1;
  double nearest = kFarMm, second = kFarMm;
  for (int b = 0; b < fields_.size(); ++b) {
    const double d = fields_.Distance(b, rest);
    if (d < nearest)
      second = nearest, nearest = d, bone = b;
    else if (d < second)
      second = d;
  }
  // The layer thins out between two bones, so that each bone's surface moves with its own bone.
  const double layer = std::min(blend_mm_, std::max(second, 1e-6));
  double hold = nearest <= 0 ? 1.0 : nearest >= layer ? 0.0 : 1.0 - SmoothStep(0, layer, nearest);
  if (hold > 0 && nearest > 0) hold *= 1.0 - anatomy_.Slip(bone, rest);
  Local local{Vector3d::Zero(), Matrix3d::Zero(), nearest};
  if (hold > 0) {
    const RigidTransform& motion = posed_.posed_from_template[size_t(bone)];
    local.posed += hold * Move(motion, rest);
    local.slope += hold * motion.rotation.toRotationMatrix();
  }
  if (hold >= 1) return local;
  const TetLocation location = mesh_.Locate(rest);
  if (location.tet < 0) return std::nullopt;
  for (int n = 0; n < 4; ++n) {
    local.posed += (1 - hold) * location.weights[size_t(n)] *
                   posed_.nodes[size_t(mesh_.tets[size_t(location.tet)][size_t(n)])];
  }
  local.slope += (1 - hold) * DeformationGradient(mesh_, posed_.nodes, location.tet);
  return local;
}

std::optional<Vector3d> CompositeMotion::Forward(const Vector3d& rest) const {
  const std::optional<Local> local = At(rest);
  if (!local) return std::nullopt;
  return local->posed;
}

std::optional<MaterialPoint> CompositeMotion::BoneAt(const Vector3d& posed) const {
  std::optional<MaterialPoint> found;
  double deepest = 0;
  for (int b = 0; b < fields_.size(); ++b) {
    if (!bone_boxes_[size_t(b)].Contains(posed)) continue;
    const Vector3d rest = Move(template_from_posed_[size_t(b)], posed);
    const double d = fields_.Distance(b, rest);
    if (d <= deepest) deepest = d, found = MaterialPoint{rest, b};
  }
  return found;
}

std::optional<MaterialPoint> CompositeMotion::SoftFrom(const Vector3d& posed, Vector3d rest) const {
  for (int step = 0; step < 12; ++step) {
    const std::optional<Local> local = At(rest);
    if (!local) return std::nullopt;
    const Vector3d miss = posed - local->posed;
    if (miss.squaredNorm() < kInverseMm * kInverseMm) {
      if (local->bone_distance_mm < 0) return std::nullopt;  // solid that only reaches into a bone
      return MaterialPoint{rest, -1};
    }
    if (std::abs(local->slope.determinant()) < 1e-3) return std::nullopt;
    rest += local->slope.inverse() * miss;
  }
  return std::nullopt;
}

std::optional<MaterialPoint> CompositeMotion::Inverse(const Vector3d& posed) const {
  if (const std::optional<MaterialPoint> bone = BoneAt(posed)) return bone;
  std::optional<MaterialPoint> found;
  locator_.ForEachAround(posed, [&](int, const Vector3d& rest) {
    const std::optional<MaterialPoint> candidate = SoftFrom(posed, rest);
    if (!candidate) return false;
    const bool tissue = skin_.At(candidate->rest) <= 0;
    if (tissue || !found) found = candidate;
    return tissue;
  });
  return found;
}

int CompositeMotion::Carrier(const Vector3d& rest) const {
  const NearestBone nearest = fields_.Nearest(rest);
  return nearest.distance_mm <= 0 ? nearest.bone : -1;
}

}  // namespace kvx::phantom
