// Least squares, and where the surfaces of two bones come close.
#include "pipeline/skeleton/joint_centre.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "core/host/parallel.h"
#include "core/voxels/label_surface.h"
#include "core/voxels/voxel_box.h"

namespace kvx {
namespace {

// A rotation of 2 degrees weighs as much as the gap: |R - I|^2 = 2 (1 - cos) ~ 1.2e-3.
constexpr double kGapWeight = 1e-3;
// A head's centre is met within 2 mm or so, a turning joint strays by some 0.4 mm: (0.4 / 2)^2.
constexpr double kHeadWeight = 0.04;
constexpr double kFarApartMm = 15;                 // wider than the cartilage of any joint
constexpr double kSameMm = 1e-6, kSameMm2 = 1e-6;  // rounding
constexpr size_t kMostVoxels = 12000;              // of a bone's surface that are compared

std::vector<Eigen::Vector3d> SurfaceOf(const LabelMap& labels, int label) {
  const VoxelBox box = BoxOf(labels, label);
  const size_t slices = size_t(box.size().z());
  return ParallelCollect<Eigen::Vector3d>(slices, [&](std::vector<Eigen::Vector3d>& surface, size_t slice) {
    VoxelBox part = box;
    part.low.z() += int(slice), part.high.z() = part.low.z() + 1;
    ForEachVoxel(part, labels.grid, [&](const Eigen::Vector3i& in_part, size_t, size_t v) {
      if (labels.values[v] != label) return;
      const Eigen::Vector3i p = in_part + part.low;
      if (AtSurface(labels, p)) surface.push_back(labels.grid.ToMm(p.x(), p.y(), p.z()).lps);
    });
  });
}

// Those that any of the other points may lie within kFarApartMm of.
std::vector<Eigen::Vector3d> NearBoxOf(const std::vector<Eigen::Vector3d>& others,
                                       const std::vector<Eigen::Vector3d>& points) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& x : others) box.extend(x);
  std::vector<Eigen::Vector3d> near;
  for (const Eigen::Vector3d& x : points)
    if (!box.isEmpty() && box.squaredExteriorDistance(x) <= kFarApartMm * kFarApartMm) near.push_back(x);
  return near;
}

std::vector<Eigen::Vector3d> Thinned(const std::vector<Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector3d> some;
  const size_t step = points.size() / kMostVoxels + 1;
  for (size_t n = 0; n < points.size(); n += step) some.push_back(points[n]);
  return some;
}

}  // namespace

CentreBelief UsualCentre(const BoneSet& bones, int child, bool turns_about_head) {
  const Bone &bone = bones.bones[child], &parent = bones.bones[bone.parent];
  const auto gap = FindGap(bones.labels, parent.label, bone.label);
  if (!gap) return {bone.box.origin, kGapWeight};
  if (!turns_about_head) return {*gap, kGapWeight};
  const double radius_mm = 0.5 * parent.box.extent_mm.tail<2>().minCoeff();
  return {PointMm{gap->lps - radius_mm * parent.box.axes.col(0)}, kHeadWeight};
}

PointMm FitCentre(std::span<const RelativeMotion> motions, const CentreBelief& usual) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double total = 0;
  for (const RelativeMotion& m : motions) {
    const Eigen::Matrix3d a = m.motion.rotation.toRotationMatrix() - Eigen::Matrix3d::Identity();
    normal += m.weight * a.transpose() * a;
    right -= m.weight * a.transpose() * (a * usual.place.lps + m.motion.translation_mm);
    total += m.weight;
  }
  if (total <= 0) return usual.place;
  normal += usual.weight * total * Eigen::Matrix3d::Identity();
  return {usual.place.lps + normal.ldlt().solve(right)};
}

double CentreResidualMm(std::span<const RelativeMotion> motions, const PointMm& centre) {
  double sum = 0, total = 0;
  for (const RelativeMotion& m : motions) {
    sum += m.weight * ((m.motion * centre).lps - centre.lps).squaredNorm();
    total += m.weight;
  }
  return total > 0 ? std::sqrt(sum / total) : 0.0;
}

std::optional<PointMm> FindGap(const LabelMap& labels, int parent_label, int child_label) {
  const std::vector<Eigen::Vector3d> of_parent = SurfaceOf(labels, parent_label),
                                     of_child = SurfaceOf(labels, child_label);
  const std::vector<Eigen::Vector3d> parent = Thinned(NearBoxOf(of_child, of_parent));
  const std::vector<Eigen::Vector3d> child = Thinned(NearBoxOf(of_parent, of_child));
  std::vector<std::pair<double, Eigen::Vector3d>> nearest(child.size());  // distance and midpoint
  ParallelEach(child.size(), [&](size_t n) {
    const Eigen::Vector3d& c = child[n];
    nearest[n] = {std::numeric_limits<double>::infinity(), c};
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // of those equally near: which comes first says nothing
    int equals = 0;
    for (const Eigen::Vector3d& p : parent) {
      const double away = (p - c).squaredNorm();
      if (away < nearest[n].first - kSameMm2) nearest[n].first = away, sum.setZero(), equals = 0;
      if (away < nearest[n].first + kSameMm2) sum += p, ++equals;
    }
    if (equals > 0) nearest[n].second = 0.5 * (sum / equals + c);
    nearest[n].first = std::sqrt(nearest[n].first);
  });
  double least = kFarApartMm;
  for (const auto& [away, middle] : nearest) least = std::min(least, away);
  const double reach = least + 1.5 * labels.grid.spacing_mm.maxCoeff() + kSameMm;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (const auto& [away, middle] : nearest) {
    if (away > reach || away > kFarApartMm) continue;
    sum += middle;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return PointMm{sum / count};
}

}  // namespace kvx
