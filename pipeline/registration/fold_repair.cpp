// Each round relaxes a neighbourhood of the voxels that are folded, wider from round to round.
#include "pipeline/registration/fold_repair.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <span>

#include "core/parallel.h"

namespace kvx {
namespace {

constexpr int kRounds = 12, kSweeps = 8;  // the neighbourhood widens every fourth round
constexpr float kVolumeStiffness = 20;        // at first; it evens out how much cells are squeezed
constexpr double kLeastDeterminant = 0.03;  // what is nearly flat is repaired too, so that rounding cannot fold it

bool InBody(const Mask& body, const WorkRegion& region, const Eigen::Vector3i& voxel) {
  const Eigen::Vector3i p = voxel + region.first;
  return body.grid.Contains(p) && body(p.x(), p.y(), p.z());
}

ElasticLattice LatticeOf(const LabelMap& bone_labels, const Mask& body, const WorkRegion& region) {
  ElasticLattice out;
  const Grid& grid = region.grid;
  out.size = grid.size;
  out.rest_spacing_mm = grid.spacing_mm;
  out.handedness = grid.direction.determinant() < 0 ? -1 : 1;
  out.kinds.assign(grid.VoxelCount(), NodeKind::kFree);
  out.joined.assign(grid.VoxelCount(), 0);
  ParallelRanges(grid.VoxelCount(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      const Eigen::Vector3i voxel = grid.Ijk(v), p = voxel + region.first;
      if (bone_labels.grid.Contains(p) && bone_labels(p.x(), p.y(), p.z())) out.kinds[v] = NodeKind::kFixed;
      if (!InBody(body, region, voxel)) continue;
      for (int a = 0; a < 3; ++a) {
        const Eigen::Vector3i next = voxel + Eigen::Vector3i::Unit(a);
        if (next[a] < grid.size[a] && InBody(body, region, next)) out.joined[v] |= uint8_t(1 << a);
      }
    }
  });
  return out;
}

// Those of `candidates` that are, in their order.
std::vector<uint32_t> Folded(std::span<const uint32_t> candidates, const std::vector<Eigen::Vector3f>& scan_mm,
                             const Mask& body, const WorkRegion& region) {
  std::vector<uint8_t> flags(candidates.size(), 0);
  ParallelRanges(candidates.size(), [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) {
      const Eigen::Vector3i voxel = region.grid.Ijk(candidates[n]);
      flags[n] = InBody(body, region, voxel) && Determinant(scan_mm, region, body.grid, voxel) < kLeastDeterminant;
    }
  });
  std::vector<uint32_t> out;
  for (size_t n = 0; n < flags.size(); ++n)
    if (flags[n]) out.push_back(candidates[n]);
  return out;
}

// All voxels within a cube around the given ones, in order.
std::vector<uint32_t> Around(std::span<const uint32_t> voxels, int reach, const Grid& grid) {
  std::set<uint32_t> out;
  for (const uint32_t v : voxels) {
    const Eigen::Vector3i p = grid.Ijk(v);
    const Eigen::Vector3i lo = (p.array() - reach).max(0), hi = (p.array() + reach).min(grid.size.array() - 1);
    for (int k = lo.z(); k <= hi.z(); ++k) {
      for (int j = lo.y(); j <= hi.y(); ++j) {
        for (int i = lo.x(); i <= hi.x(); ++i) out.insert(uint32_t(grid.Index(i, j, k)));
      }
    }
  }
  return {out.begin(), out.end()};
}

}  // namespace

double Determinant(const std::vector<Eigen::Vector3f>& scan_mm, const WorkRegion& region, const Grid& template_grid,
                   const Eigen::Vector3i& voxel) {
  const Grid& grid = region.grid;
  Eigen::Matrix3d slope;
  for (int a = 0; a < 3; ++a) {
    const int lowest = std::max(0, -region.first[a]);
    const int highest = std::min(grid.size[a], template_grid.size[a] - region.first[a]) - 1;
    Eigen::Vector3i lo = voxel, hi = voxel;
    lo[a] = std::max(voxel[a] - 1, lowest);
    hi[a] = std::min(voxel[a] + 1, highest);
    slope.col(a) = (scan_mm[grid.Index(hi.x(), hi.y(), hi.z())] - scan_mm[grid.Index(lo.x(), lo.y(), lo.z())])
                       .cast<double>() / (std::max(1, hi[a] - lo[a]) * grid.spacing_mm[a]);
  }
  return slope.determinant() * (grid.direction.determinant() < 0 ? -1 : 1);
}

void Unfold(const LabelMap& bone_labels, const Mask& body, const WorkRegion& region,
            std::vector<Eigen::Vector3f>& scan_mm) {
  std::vector<uint32_t> all(scan_mm.size());
  std::iota(all.begin(), all.end(), 0);
  std::vector<uint32_t> folded = Folded(all, scan_mm, body, region);
  if (folded.empty()) return;
  ElasticLattice lattice = LatticeOf(bone_labels, body, region);
  lattice.positions_mm = std::move(scan_mm);
  lattice.volume_stiffness = kVolumeStiffness;
  lattice.air_stiffness = 1;  // the skin is folded as soon as the air beside it is
  for (int round = 0; round < kRounds && !folded.empty(); ++round) {
    const int reach = std::min(3, 1 + round / 4);
    if (round % 4 == 3) lattice.volume_stiffness *= 2;
    Relax(lattice, kSweeps, Around(folded, reach, region.grid));
    folded = Folded(Around(folded, reach + 1, region.grid), lattice.positions_mm, body, region);
  }
  scan_mm = std::move(lattice.positions_mm);
}

}  // namespace kvx
