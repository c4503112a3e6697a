// By the bones alone (eq. 2), or by the registered correspondence.
#include "pipeline/model/map_to_scan.h"

#include "core/blend.h"
#include "core/voxels/to_corner.h"

namespace kvx {
namespace {

// Eq. 2 at any point. Blends are linear in the weights, so mixing the eight maps around the point is the
// blend of the interpolated weights; where a voxel uses the guard of core/blend.h the mixture stays
// continuous.
class SkinnedPoint {
 public:
  SkinnedPoint(const WeightMap& weights, PoseVector scan_from_template)
      : weights_(weights), pose_(std::move(scan_from_template)) {}

  Eigen::Vector3d operator()(const PointMm& in_template) const {
    const Eigen::Vector3d p = weights_.grid.Nearest(weights_.grid.ToVox(in_template)).ijk;
    const Eigen::Vector3i base = p.cast<int>();
    const Eigen::Vector3d f = p - base.cast<double>();
    Eigen::Vector3d mapped = Eigen::Vector3d::Zero();
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i d = ToCorner(corner);
      double share = 1;
      for (int axis = 0; axis < 3; ++axis) share *= d[axis] ? f[axis] : 1 - f[axis];
      if (share > 0) mapped += share * AtVoxel(base + d, in_template.lps);
    }
    return mapped;
  }

 private:
  Eigen::Vector3d AtVoxel(const Eigen::Vector3i& v, const Eigen::Vector3d& x) const {
    return Apply(Blend(weights_(v.x(), v.y(), v.z()), pose_), x);
  }
  const WeightMap& weights_;
  PoseVector pose_;
};

// Outside the grid the skinned motion goes on, offset by what registration added at the nearest point of the
// grid.
Eigen::Vector3d Registered(const BorderedField& scan_from_template, const SkinnedPoint& skinned,
                           const PointMm& x) {
  const Grid& grid = scan_from_template.field().grid;
  const PointVox p = grid.ToVox(x);
  if (grid.Contains(p)) return scan_from_template(x);
  const PointMm border = grid.ToMm(grid.Nearest(p));
  return skinned(x) + scan_from_template(border) - skinned(border);
}

}  // namespace

std::vector<PointMm> MapPointsToScan(const Model& model, const std::string& scan, ScanStage stage,
                                     const std::vector<PointMm>& in_template) {
  if (scan == model.manifest().template_scan) return in_template;
  const int k = ScanIndex(model, scan);
  const SkinnedPoint skinned(model.weights(), PoseOf(model.scan_fits()[size_t(k)]));
  std::vector<PointMm> out(in_template.size());
  if (stage == ScanStage::kInitialise) {
    for (size_t i = 0; i < out.size(); ++i) out[i].lps = skinned(in_template[i]);
    return out;
  }
  const Artifact<RegisteredScan> registered = model.LoadRegistered(k);
  const BorderedField scan_from_template = Bordered(model, k, registered->scan_from_template);
  for (size_t i = 0; i < out.size(); ++i)
    out[i].lps = Registered(scan_from_template, skinned, in_template[i]);
  return out;
}

}  // namespace kvx
