// Drawing, moving and packing truth points.
#include "pipeline/phantom/truth_points.h"

#include <algorithm>

namespace kvx::phantom {
namespace {

using Eigen::Vector3d;

// What the scan shows at a point's place is further than this from the point
constexpr double kHiddenMm = 1.0;

double JointDistance(const Anatomy& anatomy, const Vector3d& x) {
  double least = 1e6;
  for (const PhantomJoint& joint : anatomy.joints) {
    if (!joint.bends) continue;
    least = std::min(least, std::max(anatomy.bones[size_t(joint.child)].shape.Distance(x),
                                     anatomy.bones[size_t(joint.parent)].shape.Distance(x)));
  }
  return std::max(least, 0.0);
}

NpyArray Vectors(const std::vector<Vector3d>& values) {
  std::vector<float> flat;
  for (const Vector3d& v : values) flat.insert(flat.end(), {float(v.x()), float(v.y()), float(v.z())});
  return MakeNpy<float>({values.size(), 3}, flat);
}

}  // namespace

std::vector<TruthPoint> DrawTruthPoints(const Anatomy& anatomy, const TissueModel& tissues,
                                        const ScanGrid& grid, const CompositeMotion& motion, int count,
                                        uint64_t seed) {
  Random random(seed, "truth points");
  std::vector<TruthPoint> points;
  const Box body = anatomy.body.Bounds();
  const Vector3d low = grid.Origin().cwiseMax(body.low), high = (-grid.Origin()).cwiseMin(body.high);
  while (points.size() < size_t(count)) {
    const double x = random.Uniform(low.x(), high.x()), y = random.Uniform(low.y(), high.y());
    const Vector3d rest(x, y, random.Uniform(low.z(), high.z()));
    if (anatomy.body.Distance(rest) > 0 || !motion.Forward(rest)) continue;
    // As stored: 32-bit floats, so that template and positions agree to the last bit that a file keeps.
    const Vector3d stored = rest.cast<float>().cast<double>();
    const int bone = tissues.BoneAt(stored);
    if (bone >= 0 && motion.Carrier(stored) != bone)
      continue;  // within the sampling error of a bone's surface
    points.push_back({stored, tissues.At(stored, 0.1).tissue, bone + 1, JointDistance(anatomy, stored)});
  }
  return points;
}

TruthPositions MoveTruthPoints(const std::vector<TruthPoint>& points, const CompositeMotion& motion,
                               const RigidTransform& scan_from_posed, const ScanGrid& grid) {
  TruthPositions moved;
  for (const TruthPoint& point : points) {
    const std::optional<Vector3d> posed = motion.Forward(point.rest);
    const std::optional<MaterialPoint> shown = posed ? motion.Inverse(*posed) : std::nullopt;
    moved.hidden.push_back(!shown || (shown->rest - point.rest).norm() > kHiddenMm);
    moved.in_scan.push_back(Move(scan_from_posed, posed.value_or(point.rest)));
    moved.in_fov.push_back(grid.Sees(moved.in_scan.back()));
    moved.hidden_share += moved.hidden.back() / double(points.size());
    moved.in_fov_share += moved.in_fov.back() / double(points.size());
  }
  return moved;
}

MapFaults FaultsOf(const std::vector<TruthPoint>& points, const CompositeMotion& motion) {
  MapFaults faults;
  double soft = 0;
  for (const TruthPoint& point : points) {
    if (motion.Carrier(point.rest) >= 0) continue;
    const double shared_mm = motion.SharedDepthMm(point.rest);
    faults.folded_share += motion.VolumeRatio(point.rest).value_or(1) <= 0;
    faults.overlapping_share += shared_mm > 0;
    faults.overlap_mm = std::max(faults.overlap_mm, shared_mm);
    ++soft;
  }
  faults.folded_share /= std::max(1.0, soft);
  faults.overlapping_share /= std::max(1.0, soft);
  return faults;
}

NpyArrays TruthArrays(const std::vector<TruthPoint>& points, const TruthPositions& positions) {
  std::vector<Vector3d> rest;
  std::vector<uint8_t> tissue, bone;
  std::vector<float> joint_mm;
  for (const TruthPoint& point : points) {
    rest.push_back(point.rest);
    tissue.push_back(uint8_t(point.tissue));
    bone.push_back(uint8_t(point.bone));
    joint_mm.push_back(float(point.joint_mm));
  }
  std::vector<std::string> names;
  for (int t = 0; t < kTissueCount; ++t) names.emplace_back(NameOf(Tissue(t)));
  return {{"template", Vectors(rest)},
          {"position", Vectors(positions.in_scan)},
          {"tissue", MakeNpy<uint8_t>({tissue.size()}, tissue)},
          {"tissue_names", MakeStringNpy(names)},
          {"bone", MakeNpy<uint8_t>({bone.size()}, bone)},
          {"in_fov", MakeBoolNpy({positions.in_fov.size()}, positions.in_fov)},
          {"hidden", MakeBoolNpy({positions.hidden.size()}, positions.hidden)},
          {"dist_joint", MakeNpy<float>({joint_mm.size()}, joint_mm)}};
}

}  // namespace kvx::phantom
