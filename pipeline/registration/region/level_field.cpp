// Host loops over whole grids.
#include "pipeline/registration/region/level_field.h"

#include <atomic>

#include "core/host/parallel.h"
#include "pipeline/registration/region/blend_table.h"

namespace kvx {
namespace {

// Trilinear, clamped to the border; p in voxels of `grid`.
template <class Vector>
Vector SampleField(const std::vector<Vector>& field, const Grid& grid, const Eigen::Vector3d& p) {
  Eigen::Vector3i lo, hi;
  Eigen::Vector3f f;
  for (int a = 0; a < 3; ++a) {
    const double at = std::clamp(p[a], 0.0, double(grid.size[a] - 1));
    lo[a] = std::min(int(at), std::max(0, grid.size[a] - 2));
    hi[a] = std::min(lo[a] + 1, grid.size[a] - 1);
    f[a] = float(at - lo[a]);
  }
  Vector sum = Vector::Zero();
  for (int c = 0; c < 8; ++c) {
    const bool x = c & 1, y = c & 2, z = c & 4;
    const float w = (x ? f.x() : 1 - f.x()) * (y ? f.y() : 1 - f.y()) * (z ? f.z() : 1 - f.z());
    sum += w * field[grid.Index(x ? hi.x() : lo.x(), y ? hi.y() : lo.y(), z ? hi.z() : lo.z())];
  }
  return sum;
}

double OrientationAt(const DisplacementField& field, const Eigen::Vector3i& p) {
  Eigen::Matrix3d slope;  // d(mm) / d(voxel)
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector3i lo = (p - Eigen::Vector3i::Unit(a)).cwiseMax(0);
    const Eigen::Vector3i hi =
        (p + Eigen::Vector3i::Unit(a)).cwiseMin((field.grid.size.array() - 1).matrix());
    const Eigen::Vector3d change =
        (field(hi.x(), hi.y(), hi.z()) - field(lo.x(), lo.y(), lo.z())).cast<double>();
    slope.col(a) = change / std::max(1, hi[a] - lo[a]);
  }
  const Eigen::Matrix3d mm = field.grid.MmFromVox();
  return (mm + slope).determinant() / mm.determinant();
}

}  // namespace

std::vector<FieldVector> Refined(const std::vector<FieldVector>& field, const Grid& coarse,
                                 const BlockLevel& fine) {
  std::vector<FieldVector> out(fine.grid.VoxelCount());
  ParallelEach(out.size(), [&](size_t v) {
    const Eigen::Vector3d p = (fine.grid.Ijk(v).cast<double>() - Eigen::Vector3d::Constant(0.5)) / 2;
    out[v] = fine.mobility[v] * SampleField(field, coarse, p);
  });
  return out;
}

std::vector<Eigen::Vector3f> StartAfter(const std::vector<Eigen::Vector3f>& start_mm,
                                        const WorkRegion& region, const std::vector<FieldVector>& field) {
  std::vector<Eigen::Vector3f> out(start_mm.size());
  const Eigen::Matrix3d vox_from_mm = region.grid.VoxFromMm();
  ParallelEach(out.size(), [&](size_t v) {
    const Eigen::Vector3d d = field[v].head<3>().cast<double>();
    if (d == Eigen::Vector3d::Zero()) return void(out[v] = start_mm[v]);  // as in most of the air
    out[v] = SampleField(start_mm, region.grid, region.grid.Ijk(v).cast<double>() + vox_from_mm * d);
  });
  return out;
}

DisplacementField OnTemplate(const WeightMap& weights, const PoseVector& scan_from_template,
                             const WorkRegion& region, const std::vector<Eigen::Vector3f>& scan_mm) {
  const BlendTable blend(scan_from_template);
  const auto skinned = [&](const Eigen::Vector3i& p) {
    return Apply(blend(weights(p.x(), p.y(), p.z())), weights.grid.ToMm(p.x(), p.y(), p.z()).lps);
  };
  DisplacementField out(weights.grid);
  ParallelEach(out.values.size(), [&](size_t v) {
    const Eigen::Vector3i p = weights.grid.Ijk(v);
    const Eigen::Vector3d x = weights.grid.ToMm(p.x(), p.y(), p.z()).lps;
    const Eigen::Vector3i q = region.grid.Nearest(Eigen::Vector3i(p - region.first));
    const Eigen::Vector3d at = scan_mm[region.grid.Index(q.x(), q.y(), q.z())].cast<double>();
    const Eigen::Vector3i border = q + region.first;
    const Eigen::Vector3d beyond =
        border == p ? Eigen::Vector3d::Zero() : Eigen::Vector3d(skinned(p) - skinned(border));
    out.values[v] = (at + beyond - x).cast<float>();
  });
  return out;
}

double FoldedFraction(const DisplacementField& field, const Mask& body) {
  std::atomic<int64_t> folded = 0, inside = 0;
  ParallelRanges(body.values.size(), [&](size_t begin, size_t end) {
    int64_t here = 0, count = 0;
    for (size_t v = begin; v < end; ++v) {
      if (!body.values[v]) continue;
      ++count;
      here += OrientationAt(field, body.grid.Ijk(v)) <= 0;
    }
    folded += here;
    inside += count;
  });
  return inside > 0 ? double(folded) / double(inside) : 0.0;
}

}  // namespace kvx
