// Forward in closed form; inverse by damped Newton steps from the solid's own inverse.
#include "pipeline/phantom/motion/composite_motion.h"

#include "core/numbers/smooth_step.h"

namespace kvx::phantom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Of a cell: the layer over which the solid gives way to the bone's own motion
constexpr double kBlendShare = 0.6;
constexpr double kInverseMm = 1e-4;  // how closely the inverse is solved
constexpr double kHoldStepMm = 1e-3;
constexpr double kLeastVolume = 1e-3;  // over that at rest, from which a Newton step can start
constexpr int kMostSteps = 40, kMostHalvings = 8;

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

CompositeMotion::Hold CompositeMotion::HoldAt(const Vector3d& rest) const {
  Hold hold;
  double second = kFarMm;
  for (int b = 0; b < fields_.size(); ++b) {
    const double d = fields_.Distance(b, rest);
    if (d < hold.distance_mm)
      second = hold.distance_mm, hold.distance_mm = d, hold.bone = b;
    else if (d < second)
      second = d;
  }
  // The layer thins out between two bones, so that each bone's surface moves with its own bone.
  const double layer = std::min(blend_mm_, std::max(second, 1e-6));
  if (hold.distance_mm >= layer) return hold;
  hold.share = hold.distance_mm <= 0 ? 1.0 : 1.0 - SmoothStep(0, layer, hold.distance_mm);
  if (hold.distance_mm > 0) hold.share *= 1.0 - anatomy_.Slip(hold.bone, rest);
  return hold;
}

Vector3d CompositeMotion::HoldSlope(const Vector3d& rest) const {
  Vector3d slope;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d along = kHoldStepMm * Vector3d::Unit(axis);
    slope[axis] = (HoldAt(rest + along).share - HoldAt(rest - along).share) / (2 * kHoldStepMm);
  }
  return slope;
}

std::optional<CompositeMotion::Local> CompositeMotion::At(const Vector3d& rest) const {
  Local local{HoldAt(rest)};
  if (local.hold.share > 0) {
    local.by_bone = Move(posed_.posed_from_template[size_t(local.hold.bone)], rest);
    local.posed += local.hold.share * local.by_bone;
  }
  if (local.hold.share >= 1) return local;
  const TetLocation location = mesh_.Locate(rest);
  if (location.tet < 0) return std::nullopt;
  local.tet = location.tet;
  for (size_t n = 0; n < 4; ++n)
    local.by_solid += location.weights[n] * posed_.nodes[size_t(mesh_.tets[size_t(local.tet)][n])];
  local.posed += (1 - local.hold.share) * local.by_solid;
  return local;
}

Matrix3d CompositeMotion::SlopeOf(const Vector3d& rest, const Local& local) const {
  const double share = local.hold.share;
  Matrix3d slope = Matrix3d::Zero();
  if (share > 0)
    slope = share * posed_.posed_from_template[size_t(local.hold.bone)].rotation.toRotationMatrix();
  if (share >= 1) return slope;
  slope += (1 - share) * DeformationGradient(mesh_, posed_.nodes, local.tet);
  if (share > 0) slope += (local.by_bone - local.by_solid) * HoldSlope(rest).transpose();
  return slope;
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

// Moves `rest` by a Newton step, shortened until it comes closer to `posed`. Nothing where it cannot.
std::optional<CompositeMotion::Local> CompositeMotion::Closer(const Vector3d& posed, const Local& local,
                                                              Vector3d& rest) const {
  const Matrix3d slope = SlopeOf(rest, local);
  if (std::abs(slope.determinant()) < kLeastVolume) return std::nullopt;
  const Vector3d miss = posed - local.posed;
  Vector3d way = slope.inverse() * miss;
  way *= std::min(1.0, blend_mm_ / way.norm());
  for (int halving = 0; halving < kMostHalvings; ++halving, way *= 0.5) {
    const std::optional<Local> next = At(rest + way);
    if (!next || (posed - next->posed).squaredNorm() >= miss.squaredNorm()) continue;
    rest += way;
    return next;
  }
  return std::nullopt;
}

std::optional<MaterialPoint> CompositeMotion::SoftFrom(const Vector3d& posed, Vector3d rest) const {
  std::optional<Local> local = At(rest);
  for (int step = 0; local && step < kMostSteps; ++step) {
    if ((posed - local->posed).squaredNorm() < kInverseMm * kInverseMm) {
      if (local->hold.distance_mm < 0) return std::nullopt;  // solid that only reaches into a bone
      return MaterialPoint{rest, -1};
    }
    local = Closer(posed, *local, rest);
  }
  return std::nullopt;
}

std::optional<MaterialPoint> CompositeMotion::Inverse(const Vector3d& posed) const {
  if (const std::optional<MaterialPoint> bone = BoneAt(posed)) return bone;
  std::optional<MaterialPoint> found;
  const auto finds_tissue = [&](const Vector3d& start) {
    const std::optional<MaterialPoint> candidate = SoftFrom(posed, start);
    if (!candidate) return false;
    const bool tissue = skin_.At(candidate->rest) <= 0;
    if (tissue || !found) found = candidate;
    return tissue;
  };
  locator_.ForEachAround(posed, [&](int, const Vector3d& rest) { return finds_tissue(rest); });
  if (found) return found;
  // The solid reaches into bones, where a step leads nowhere; beside it one may.
  locator_.ForEachAround(posed, [&](int, const Vector3d& rest) {
    for (int way = 0; way < 6; ++way) {
      const Vector3d beside = (way < 3 ? 0.5 : -0.5) * blend_mm_ * Vector3d::Unit(way % 3);
      if (finds_tissue(rest + beside)) return true;
    }
    return false;
  });
  return found;
}

std::optional<double> CompositeMotion::VolumeRatio(const Vector3d& rest) const {
  const std::optional<Local> local = At(rest);
  if (!local) return std::nullopt;
  return SlopeOf(rest, *local).determinant();
}

double CompositeMotion::SharedDepthMm(const Vector3d& rest) const {
  const std::optional<Local> local = At(rest);
  if (!local || BoneAt(local->posed)) return 0;
  double deepest = 0;
  locator_.ForEachAround(local->posed, [&](int, const Vector3d& start) {
    const std::optional<MaterialPoint> other = SoftFrom(local->posed, start);
    if (other && (other->rest - rest).norm() > kFarCells * mesh_.cell_mm)
      deepest = std::max(deepest, -std::max(skin_.At(rest), skin_.At(other->rest)));
    return false;
  });
  return deepest;
}

int CompositeMotion::Carrier(const Vector3d& rest) const {
  const NearestBone nearest = fields_.Nearest(rest);
  return nearest.distance_mm <= 0 ? nearest.bone : -1;
}

}  // namespace kvx::phantom
