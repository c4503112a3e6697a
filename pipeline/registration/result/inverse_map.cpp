// Newton's method, started from the body voxel that comes nearest.
#include "pipeline/registration/result/inverse_map.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "core/host/parallel.h"

namespace kvx {
namespace {

constexpr uint32_t kNobody = std::numeric_limits<uint32_t>::max();
constexpr int kSteps = 25;
constexpr double kExactVoxels = 1e-3;    // of the template
constexpr double kLongestStep = 2;       // voxels of the template
constexpr size_t kVoxelsPerLook = 4096;  // between two questions whether to go on

// Differences over half a voxel to either side.
Eigen::Matrix3d JacobianAt(const BorderedField& carried, const PointMm& x) {
  Eigen::Matrix3d out;
  const double half_mm = 0.5 * carried.field().grid.spacing_mm.minCoeff();
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector3d step = half_mm * Eigen::Vector3d::Unit(a);
    out.col(a) = (carried({x.lps + step}) - carried({x.lps - step})) / (2 * half_mm);
  }
  return out;
}

std::vector<uint32_t> Tenants(const DisplacementField& field, const Mask& body, const Grid& scan) {
  std::vector<uint32_t> out(scan.VoxelCount(), kNobody);
  for (size_t v = body.values.size(); v-- > 0;) {
    if (!body.values[v]) continue;
    const Eigen::Vector3d there =
        field.grid.ToMm(PointVox{field.grid.Ijk(v).cast<double>()}).lps + field.values[v].cast<double>();
    const Eigen::Vector3i p = scan.ToVox(PointMm{there}).ijk.array().round().cast<int>();
    if (scan.Contains(p)) out[scan.Index(p.x(), p.y(), p.z())] = uint32_t(v);
  }
  return out;
}

// Empty voxels take the first of their neighbours' tenants.
std::vector<uint32_t> Spread(const std::vector<uint32_t>& tenants, const Grid& scan) {
  std::vector<uint32_t> out = tenants;
  ParallelEach(out.size(), [&](size_t v) {
    const Eigen::Vector3i p = scan.Ijk(v);
    for (int n = 0; n < 27 && out[v] == kNobody; ++n) {
      const Eigen::Vector3i q = p + Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      if (scan.Contains(q)) out[v] = tenants[scan.Index(q.x(), q.y(), q.z())];
    }
  });
  return out;
}

// How far a tenant is told of, in voxels of the scan: to the template's next voxel, which may lie outside the
// scan, and one more, as tissue is stretched.
int SpreadsFor(const Grid& body, const Grid& scan) {
  return int(std::ceil(body.spacing_mm.maxCoeff() / scan.spacing_mm.minCoeff() - 0.01)) + 1;
}

}  // namespace

InverseMap::InverseMap(const BorderedField& scan_from_template, const Mask& body, const Grid& scan)
    : scan_from_template_(scan_from_template),
      body_(body),
      scan_(scan),
      tenants_(Tenants(scan_from_template.field(), body, scan)) {
  for (int n = 0; n < SpreadsFor(body.grid, scan); ++n) tenants_ = Spread(tenants_, scan_);
}

bool InverseMap::InTissue(const PointMm& in_template) const {
  const Eigen::Vector3i p = body_.grid.ToVox(in_template).ijk.array().round().cast<int>();
  return body_.grid.Contains(p) && body_(p.x(), p.y(), p.z());
}

std::optional<PointMm> InverseMap::From(const PointMm& first, const PointMm& in_scan) const {
  const double voxel_mm = body_.grid.spacing_mm.minCoeff();
  PointMm x = first;
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::Vector3d off = in_scan.lps - scan_from_template_(x);
    if (off.norm() < kExactVoxels * voxel_mm) return InTissue(x) ? std::optional(x) : std::nullopt;
    Eigen::Vector3d move = JacobianAt(scan_from_template_, x).partialPivLu().solve(off);
    if (!move.allFinite()) return std::nullopt;
    const double length = move.norm();
    if (length > kLongestStep * voxel_mm) move *= kLongestStep * voxel_mm / length;
    x.lps += (step > kSteps / 2 ? 0.5 : 1.0) * move;  // shorter where it runs in circles
  }
  return std::nullopt;
}

std::optional<PointMm> InverseMap::operator()(const PointMm& in_scan) const {
  const Eigen::Vector3i p = scan_.ToVox(in_scan).ijk.array().round().cast<int>();
  if (!scan_.Contains(p)) return std::nullopt;
  const auto start = [&](const Eigen::Vector3i& q) -> std::optional<PointMm> {
    const uint32_t tenant = scan_.Contains(q) ? tenants_[scan_.Index(q.x(), q.y(), q.z())] : kNobody;
    if (tenant == kNobody) return std::nullopt;
    return From(body_.grid.ToMm(PointVox{body_.grid.Ijk(tenant).cast<double>()}), in_scan);
  };
  if (const auto found = start(p)) return found;
  for (int a = 0; a < 3; ++a) {
    for (const int side : {-1, 1})
      if (const auto found = start(p + side * Eigen::Vector3i::Unit(a))) return found;
  }
  return std::nullopt;
}

DisplacementField InverseField(const BorderedField& scan_from_template, const Mask& body, const Grid& scan,
                               const Progress& progress) {
  const InverseMap template_from_scan(scan_from_template, body, scan);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  DisplacementField out(scan, Eigen::Vector3f::Constant(kNan));
  ParallelEach(out.values.size(), [&](size_t v) {
    if (v % kVoxelsPerLook == 0) progress.ThrowIfCancelled();
    const PointMm x = scan.ToMm(PointVox{scan.Ijk(v).cast<double>()});
    if (const auto found = template_from_scan(x)) out.values[v] = (found->lps - x.lps).cast<float>();
  });
  return out;
}

}  // namespace kvx
