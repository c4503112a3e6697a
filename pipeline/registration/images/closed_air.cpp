// The tissue is dealt out to the scan's voxels; then the air looks who is there.
#include "pipeline/registration/images/closed_air.h"

#include <limits>

#include "core/host/parallel.h"

namespace kvx {
namespace {

constexpr uint32_t kNobody = std::numeric_limits<uint32_t>::max();
// Of the template: further than a start that is merely wrong by some voxels reaches
constexpr double kElsewhereVoxels = 6;

int64_t Landing(const Eigen::Vector4f& start, const Grid& scan) {
  const Eigen::Vector3i p = start.head<3>().array().round().cast<int>();
  return scan.Contains(p) ? int64_t(scan.Index(p.x(), p.y(), p.z())) : -1;
}

// The first body voxel that comes to every voxel of the scan.
std::vector<uint32_t> Tenants(const Mask& body, std::span<const Eigen::Vector4f> start, const Grid& scan) {
  std::vector<uint32_t> out(scan.VoxelCount(), kNobody);
  for (size_t v = body.values.size(); v-- > 0;) {
    const int64_t at = body.values[v] ? Landing(start[v], scan) : -1;
    if (at >= 0) out[size_t(at)] = uint32_t(v);
  }
  return out;
}

}  // namespace

Mask ClosedAir(const Mask& body, std::span<const Eigen::Vector4f> start, const Grid& scan) {
  const std::vector<uint32_t> tenants = Tenants(body, start, scan);
  Mask out(body.grid);
  ParallelEach(body.values.size(), [&](size_t v) {
    const int64_t at = body.values[v] ? -1 : Landing(start[v], scan);
    if (at < 0 || tenants[size_t(at)] == kNobody) return;
    const Eigen::Vector3i away = body.grid.Ijk(tenants[size_t(at)]) - body.grid.Ijk(v);
    out.values[v] = away.cast<double>().norm() > kElsewhereVoxels;
  });
  return out;
}

}  // namespace kvx
