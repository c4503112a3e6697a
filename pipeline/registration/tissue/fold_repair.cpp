// Each round relaxes a neighbourhood of the voxels that are folded, wider from round to round. What remains,
// mostly between bones that nearly touch, is opened voxel by voxel.
#include "pipeline/registration/tissue/fold_repair.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <span>

#include "core/host/parallel.h"
#include "core/voxels/voxel_box.h"
#include "kernels/reference/elastic_relaxation.h"

namespace kvx {
namespace {

constexpr int kRounds = 12, kSweeps = 8;  // the neighbourhood widens every fourth round
constexpr float kVolumeStiffness = 20;    // at first; it evens out how much cells are squeezed
// What is nearly flat is repaired too, so that rounding cannot fold it
constexpr double kLeastDeterminant = 0.03;
constexpr double kOpenDeterminant = 0.06;  // to which a voxel is opened
constexpr double kLongestPush = 0.5;       // of a neighbour at once, in voxels
// How willingly bone moves beside tissue, while opening goes on: not at all as long as that may help. Two
// bones that were found one inside the other leave no other way.
constexpr struct {
  int rounds;
  double bone_share;
} kOpenings[] = {{60, 0.0}, {60, 0.02}, {120, 0.2}, {200, 1.0}};

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
  ParallelEach(grid.VoxelCount(), [&](size_t v) {
    const Eigen::Vector3i voxel = grid.Ijk(v), p = voxel + region.first;
    if (bone_labels.grid.Contains(p) && bone_labels(p.x(), p.y(), p.z())) out.kinds[v] = NodeKind::kFixed;
    if (!InBody(body, region, voxel)) return;
    for (int a = 0; a < 3; ++a) {
      const Eigen::Vector3i next = voxel + Eigen::Vector3i::Unit(a);
      if (next[a] < grid.size[a] && InBody(body, region, next)) out.joined[v] |= uint8_t(1 << a);
    }
  });
  return out;
}

// The neighbours whose differences are the columns of a voxel's Jacobian.
struct Stencil {
  std::array<size_t, 3> lower, upper;
  std::array<double, 3> span_mm;
};

Stencil StencilOf(const WorkRegion& region, const Grid& template_grid, const Eigen::Vector3i& voxel) {
  const Grid& grid = region.grid;
  Stencil out;
  for (int a = 0; a < 3; ++a) {
    const int lowest = std::max(0, -region.first[a]);
    const int highest = std::min(grid.size[a], template_grid.size[a] - region.first[a]) - 1;
    Eigen::Vector3i lo = voxel, hi = voxel;
    lo[a] = std::max(voxel[a] - 1, lowest);
    hi[a] = std::min(voxel[a] + 1, highest);
    out.lower[a] = grid.Index(lo.x(), lo.y(), lo.z());
    out.upper[a] = grid.Index(hi.x(), hi.y(), hi.z());
    out.span_mm[a] = std::max(1, hi[a] - lo[a]) * grid.spacing_mm[a];
  }
  return out;
}

Eigen::Matrix3d JacobianAt(const std::vector<Eigen::Vector3f>& scan_mm, const Stencil& stencil) {
  Eigen::Matrix3d out;
  for (int a = 0; a < 3; ++a)
    out.col(a) = (scan_mm[stencil.upper[a]] - scan_mm[stencil.lower[a]]).cast<double>() / stencil.span_mm[a];
  return out;
}

bool IsFolded(size_t voxel, const std::vector<Eigen::Vector3f>& scan_mm, const Mask& body,
              const WorkRegion& region) {
  const Eigen::Vector3i at = region.grid.Ijk(voxel);
  return InBody(body, region, at) && Determinant(scan_mm, region, body.grid, at) < kLeastDeterminant;
}

// In order.
std::vector<uint32_t> AllFolded(const std::vector<Eigen::Vector3f>& scan_mm, const Mask& body,
                                const WorkRegion& region) {
  const size_t slices = size_t(region.grid.size.z()), voxels = scan_mm.size() / slices;  // of a slice
  return ParallelCollect<uint32_t>(slices, [&](std::vector<uint32_t>& folded, size_t k) {
    for (size_t v = k * voxels; v < (k + 1) * voxels; ++v)
      if (IsFolded(v, scan_mm, body, region)) folded.push_back(uint32_t(v));
  });
}

// Those of `candidates` that are, in their order.
std::vector<uint32_t> Folded(std::span<const uint32_t> candidates,
                             const std::vector<Eigen::Vector3f>& scan_mm, const Mask& body,
                             const WorkRegion& region) {
  std::vector<uint8_t> flags(candidates.size(), 0);
  ParallelEach(candidates.size(),
               [&](size_t n) { flags[n] = IsFolded(candidates[n], scan_mm, body, region); });
  std::vector<uint32_t> out;
  for (size_t n = 0; n < flags.size(); ++n)
    if (flags[n]) out.push_back(candidates[n]);
  return out;
}

// All voxels within a cube around the given ones, in order.
std::vector<uint32_t> Around(std::span<const uint32_t> voxels, int reach, const Grid& grid) {
  std::vector<uint32_t> out;
  std::vector<bool> listed(grid.VoxelCount(), false);
  for (const uint32_t v : voxels) {
    const Eigen::Vector3i p = grid.Ijk(v);
    const VoxelBox cube =
        VoxelBox{p, p + Eigen::Vector3i::Ones()}.Grown(Eigen::Vector3i::Constant(reach), grid);
    ForEachVoxel(cube, grid, [&](const auto&, size_t, size_t near) {
      if (listed[near]) return;
      listed[near] = true;
      out.push_back(uint32_t(near));
    });
  }
  std::ranges::sort(out);
  return out;
}

// The least motion of the voxel's neighbours that makes its determinant kOpenDeterminant, to first order.
void Open(const Stencil& stencil, double bone_share, ElasticLattice& lattice) {
  const Eigen::Matrix3d jacobian = JacobianAt(lattice.positions_mm, stencil);
  std::array<Eigen::Vector3d, 3> slope;  // of the determinant in the position of the upper neighbour
  double squares = 0;
  const auto share = [&](size_t v) { return lattice.kinds[v] == NodeKind::kFixed ? bone_share : 1.0; };
  for (int a = 0; a < 3; ++a) {
    slope[a] = jacobian.col((a + 1) % 3).cross(jacobian.col((a + 2) % 3)) *
               (lattice.handedness / stencil.span_mm[a]);
    squares += (share(stencil.lower[a]) + share(stencil.upper[a])) * slope[a].squaredNorm();
  }
  if (!(squares > 1e-12)) return;
  const double length = (kOpenDeterminant - lattice.handedness * jacobian.determinant()) / squares;
  const double longest_mm = kLongestPush * lattice.rest_spacing_mm.minCoeff();
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector3d push = slope[a] * std::min(length, longest_mm / std::max(1e-12, slope[a].norm()));
    lattice.positions_mm[stencil.upper[a]] += (share(stencil.upper[a]) * push).cast<float>();
    lattice.positions_mm[stencil.lower[a]] -= (share(stencil.lower[a]) * push).cast<float>();
  }
}

// Opens the folded voxels one after the other; those that this folds come next.
void OpenAll(const Mask& body, const WorkRegion& region, const Progress& progress,
             std::vector<uint32_t> folded, ElasticLattice& lattice) {
  for (const auto& [rounds, bone_share] : kOpenings) {
    for (int round = 0; round < rounds && !folded.empty(); ++round) {
      progress.ThrowIfCancelled();
      for (const uint32_t v : folded)
        Open(StencilOf(region, body.grid, region.grid.Ijk(v)), bone_share, lattice);
      folded = Folded(Around(folded, 2, region.grid), lattice.positions_mm, body, region);
    }
  }
}

// Where tissue may go: a box's width beyond all of it, where nothing goes that is not torn past mending.
// There what is folded pushes its neighbours ever farther, to where no number reaches.
class Room {
 public:
  explicit Room(const std::vector<Eigen::Vector3f>& mm) {
    for (const Eigen::Vector3f& place : mm) box_.extend(place);
    const Eigen::Vector3f wide = box_.sizes();
    box_.min() -= wide, box_.max() += wide;
  }
  bool Has(const Eigen::Vector3f& mm) const { return box_.contains(mm); }

 private:
  Eigen::AlignedBox3f box_;
};

// False, and all as it was, where a node would leave the room.
bool RelaxWithin(const Room& room, std::span<const uint32_t> nodes, const Progress& progress,
                 ElasticLattice& lattice) {
  std::vector<Eigen::Vector3f> before_mm;
  for (const uint32_t n : nodes) before_mm.push_back(lattice.positions_mm[n]);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    progress.ThrowIfCancelled();
    reference::Relax(lattice, 1, nodes);
  }
  if (std::ranges::all_of(nodes, [&](uint32_t n) { return room.Has(lattice.positions_mm[n]); })) return true;
  for (size_t n = 0; n < nodes.size(); ++n) lattice.positions_mm[nodes[n]] = before_mm[n];
  return false;
}

}  // namespace

double Determinant(const std::vector<Eigen::Vector3f>& scan_mm, const WorkRegion& region,
                   const Grid& template_grid, const Eigen::Vector3i& voxel) {
  return JacobianAt(scan_mm, StencilOf(region, template_grid, voxel)).determinant() *
         (region.grid.direction.determinant() < 0 ? -1 : 1);
}

void Unfold(const LabelMap& bone_labels, const Mask& body, const WorkRegion& region, const Progress& progress,
            std::vector<Eigen::Vector3f>& scan_mm) {
  std::vector<uint32_t> folded = AllFolded(scan_mm, body, region);
  if (folded.empty()) return;
  ElasticLattice lattice = LatticeOf(bone_labels, body, region);
  const Room room(scan_mm);
  lattice.positions_mm = std::move(scan_mm);
  lattice.volume_stiffness = kVolumeStiffness;
  lattice.air_stiffness = 1;  // the skin is folded as soon as the air beside it is
  for (int round = 0; round < kRounds && !folded.empty(); ++round) {
    const int reach = std::min(3, 1 + round / 4);
    if (round % 4 == 3) lattice.volume_stiffness *= 2;
    if (!RelaxWithin(room, Around(folded, reach, region.grid), progress, lattice)) {
      folded.clear();
      break;
    }
    folded = Folded(Around(folded, reach + 1, region.grid), lattice.positions_mm, body, region);
  }
  OpenAll(body, region, progress, std::move(folded), lattice);
  scan_mm = std::move(lattice.positions_mm);
}

}  // namespace kvx
