// Distances, contacts and inscribed balls.
#include "pipeline/bones/template/bone_shape.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "core/voxels/distance_map.h"

namespace kvx {
namespace {

constexpr double kFarMm = 1e3;
constexpr size_t kShapePoints = 300;

// Every n-th, so that about `count` remain, evenly spread.
template <class T>
std::vector<T> Thinned(const std::vector<T>& all, size_t count) {
  if (all.size() <= count) return all;
  std::vector<T> out;
  for (size_t n = 0; n < count; ++n) out.push_back(all[n * all.size() / count]);
  return out;
}

BoneShape ShapeOf(const Bone& bone, const LabelMap& labels, double margin_mm) {
  BoneShape shape;
  shape.centroid_mm = bone.centroid.lps;
  shape.axes = bone.box.axes;
  shape.extent_mm = bone.box.extent_mm;
  shape.thickness_mm = bone.box.extent_mm.minCoeff();
  shape.length_mm = bone.box.extent_mm.maxCoeff();
  shape.distance_mm = SignedDistance(labels, bone.label, margin_mm);
  const Grid& grid = shape.distance_mm.grid;
  const double rim_mm = grid.spacing_mm.maxCoeff();
  for (size_t v = 0; v < shape.distance_mm.values.size(); ++v) {
    const double d = shape.distance_mm.values[v];
    if (d >= 0) continue;
    const Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    shape.body.push_back({x, -d});
    if (-d < rim_mm) shape.surface_mm.push_back(x);
  }
  shape.body = Thinned(shape.body, kShapePoints);
  shape.surface_mm = Thinned(shape.surface_mm, kShapePoints);
  return shape;
}

// Climbs from a point at the surface to the centre of the ball inscribed there: a joint's rounded end.
Eigen::Vector3d InscribedCentre(const BoneShape& bone, Eigen::Vector3d x) {
  const double step = 0.5 * bone.distance_mm.grid.MeanSpacingMm();
  double depth = DistanceMm(bone, x);
  for (double climbed = 0; climbed < bone.thickness_mm; climbed += step) {
    Eigen::Vector3d gradient;
    for (int a = 0; a < 3; ++a) {
      const Eigen::Vector3d h = step * Eigen::Vector3d::Unit(a);
      gradient[a] = DistanceMm(bone, x + h) - DistanceMm(bone, x - h);
    }
    if (gradient.norm() < 1e-9) break;
    const Eigen::Vector3d deeper = x - step * gradient.normalized();
    const double d = DistanceMm(bone, deeper);
    if (d > depth - 0.1 * step) break;
    x = deeper, depth = d;
  }
  return x;
}

JointShape JointOf(const BoneShape& child, const BoneShape& parent, double voxel_mm) {
  JointShape joint;
  joint.gap_mm = GapMm(child, parent, RigidTransform{});
  Eigen::Vector3d contact = Eigen::Vector3d::Zero();
  double weights = 0;
  for (const Eigen::Vector3d& x : child.surface_mm) {
    const double beyond = (DistanceMm(parent, x) - joint.gap_mm) / (2 * voxel_mm);
    const double w = std::exp(-0.5 * beyond * beyond);
    contact += w * x, weights += w;
  }
  contact /= weights;
  joint.pivots_mm = {contact, InscribedCentre(parent, contact), InscribedCentre(child, contact)};
  return joint;
}

std::vector<int> NeighboursOf(const Anatomy& anatomy, int bone, int parent) {
  std::vector<std::pair<double, int>> near;
  for (int other = 0; other < int(anatomy.bones.size()); ++other) {
    if (other == bone || other == parent) continue;
    const double gap = GapMm(anatomy.bones[bone], anatomy.bones[other], RigidTransform{});
    if (gap < anatomy.bones[bone].length_mm) near.emplace_back(gap, other);
  }
  std::sort(near.begin(), near.end());
  std::vector<int> out;
  for (const auto& [gap, other] : near) out.push_back(other);
  return out;
}

// For the six points c +- h_a e_a, the mean square is |dc|^2 + 1/3 sum_a |h_a de_a|^2.
PoseMark MarkOfBox(const PointMm& centroid, const Eigen::Matrix3d& axes, const Eigen::Vector3d& extent_mm,
                   const RigidTransform& pose) {
  PoseMark mark;
  mark.head<3>() = (pose * centroid).lps;
  const Eigen::Matrix3d turned = pose.rotation.toRotationMatrix() * axes;
  for (int a = 0; a < 3; ++a) mark.segment<3>(3 + 3 * a) = turned.col(a) * (extent_mm[a] / std::sqrt(12.0));
  return mark;
}

}  // namespace

Anatomy StudyShapes(const BoneSet& bones, double distance_margin_mm) {
  Anatomy anatomy;
  anatomy.voxel_mm = bones.labels.grid.MeanSpacingMm();
  anatomy.bones.resize(bones.size());
  anatomy.joints.resize(bones.size());
  ParallelFor(bones.size(), [&](size_t b) {
    anatomy.bones[b] = ShapeOf(bones.bones[b], bones.labels, distance_margin_mm);
  });
  ParallelFor(bones.size(), [&](size_t b) {
    const int parent = bones.bones[b].parent;
    if (parent != kNoParent)
      anatomy.joints[b] = JointOf(anatomy.bones[b], anatomy.bones[parent], anatomy.voxel_mm);
    anatomy.joints[b].neighbours = NeighboursOf(anatomy, int(b), parent);
  });
  return anatomy;
}

double DistanceMm(const BoneShape& bone, const Eigen::Vector3d& x_in_template) {
  const Grid& grid = bone.distance_mm.grid;
  const Eigen::Vector3d p = grid.ToVox(PointMm{x_in_template}).ijk;
  const Eigen::Vector3d top = (grid.size.array() - 1).cast<double>().matrix();
  const Eigen::Vector3d inside = p.cwiseMax(0.0).cwiseMin(top);
  const double beyond_mm = (grid.spacing_mm.asDiagonal() * (p - inside)).norm();
  if (beyond_mm > kFarMm) return kFarMm;
  return SampleTrilinear(bone.distance_mm, PointVox{inside}) + beyond_mm;
}

double GapMm(const BoneShape& a, const BoneShape& b, const RigidTransform& b_from_a) {
  const Eigen::Matrix3d r = b_from_a.rotation.toRotationMatrix();
  double gap = kFarMm;
  for (const Eigen::Vector3d& x : a.surface_mm)
    gap = std::min(gap, DistanceMm(b, r * x + b_from_a.translation_mm));
  return gap;
}

double OverlapFraction(const BoneShape& a, const BoneShape& b, const RigidTransform& b_from_a,
                       double tolerance_mm) {
  if (a.body.empty()) return 0;
  const Eigen::Matrix3d r = b_from_a.rotation.toRotationMatrix();
  int inside = 0;
  for (const BodyPoint& point : a.body) {
    if (point.depth_mm <= tolerance_mm) continue;
    inside += DistanceMm(b, r * point.at_mm + b_from_a.translation_mm) < -tolerance_mm;
  }
  return double(inside) / double(a.body.size());
}

PoseMark MarkOf(const BoneShape& bone, const RigidTransform& pose) {
  return MarkOfBox(PointMm{bone.centroid_mm}, bone.axes, bone.extent_mm, pose);
}

double PoseDistanceMm(const BoneShape& bone, const RigidTransform& a, const RigidTransform& b) {
  return (MarkOf(bone, a) - MarkOf(bone, b)).norm();
}

double PoseDistanceMm(const Bone& bone, const RigidTransform& a, const RigidTransform& b) {
  const auto mark = [&](const RigidTransform& pose) {
    return MarkOfBox(bone.centroid, bone.box.axes, bone.box.extent_mm, pose);
  };
  return (mark(a) - mark(b)).norm();
}

}  // namespace kvx
