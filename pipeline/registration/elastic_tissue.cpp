// Coarse lattices first, every step-th voxel a node: what they move is added to the voxels between them and
// to the finer lattices.
#include "pipeline/registration/elastic_tissue.h"

#include <algorithm>

#include "core/parallel.h"
#include "pipeline/skinning/nearest_voxel.h"

namespace kvx {
namespace {

// Every how many voxels a node, and sweeps over the nodes.
constexpr struct { int step, sweeps; } kLattices[] = {{4, 40}, {2, 15}};

Eigen::Vector3i NodeAt(const ElasticLattice& lattice, size_t n) {
  return {int(n % lattice.size.x()), int(n / lattice.size.x() % lattice.size.y()),
          int(n / (size_t(lattice.size.x()) * lattice.size.y()))};
}

// Per axis, whether there is tissue from voxel `p` on for `step` voxels.
uint8_t Joined(const std::vector<NodeKind>& kinds, const Grid& grid, const Eigen::Vector3i& p, int step) {
  uint8_t out = 0;
  for (int axis = 0; axis < 3; ++axis) {
    bool whole = p[axis] + step < grid.size[axis];
    for (int n = 0; whole && n <= step; ++n) {
      const Eigen::Vector3i q = p + n * Eigen::Vector3i::Unit(axis);
      whole = kinds[grid.Index(q.x(), q.y(), q.z())] != NodeKind::kAbsent;
    }
    out |= uint8_t(whole) << axis;
  }
  return out;
}

// Every node is held as the mean of the voxels that it stands for.
void Hold(std::span<const Eigen::Matrix3f> holds, const Grid& cells, int step, ElasticLattice& lattice) {
  const int wide = step / 2;  // cells per node and axis
  lattice.holds.assign(lattice.positions_mm.size(), Eigen::Matrix3f::Zero());
  ParallelRanges(lattice.holds.size(), [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) {
      const Eigen::Vector3i first = wide * NodeAt(lattice, n) - Eigen::Vector3i::Constant(wide / 2);
      for (int c = 0; c < wide * wide * wide; ++c) {
        const Eigen::Vector3i p = first + Eigen::Vector3i(c % wide, c / wide % wide, c / (wide * wide));
        if (cells.Contains(p)) lattice.holds[n] += holds[cells.Index(p.x(), p.y(), p.z())];
      }
      lattice.holds[n] /= float(wide * wide * wide);
    }
  });
}

}  // namespace

ElasticTissue::ElasticTissue(const LabelMap& bone_labels, const Mask& body, const WorkRegion& region)
    : grid_(region.grid), kinds_(region.grid.VoxelCount(), NodeKind::kAbsent) {
  Mask tissue(region.grid);
  for (size_t v = 0; v < kinds_.size(); ++v) {
    const Eigen::Vector3i p = region.grid.Ijk(v) + region.first;
    if (!body.grid.Contains(p) || !body(p.x(), p.y(), p.z())) continue;
    tissue.values[v] = 1;
    kinds_[v] = bone_labels(p.x(), p.y(), p.z()) ? NodeKind::kFixed : NodeKind::kFree;
  }
  nearest_tissue_ = NearestMarked(tissue);
}

void ElasticTissue::Relax(std::span<const Eigen::Matrix3f> holds,
                          std::vector<Eigen::Vector3f>& scan_mm) const {
  const std::vector<Eigen::Vector3f> before = scan_mm;
  for (const auto& [step, sweeps] : kLattices) {
    ElasticLattice lattice = Subsampled(scan_mm, step);
    if (!holds.empty()) {
      lattice.held_mm = Subsampled(before, step).positions_mm;
      Hold(holds, Coarsened(grid_, 2), step, lattice);
    }
    kvx::Relax(lattice, sweeps);
    AddMoved(lattice, step, scan_mm);
  }
  CarryAir(before, scan_mm);
}

ElasticLattice ElasticTissue::Subsampled(const std::vector<Eigen::Vector3f>& scan_mm, int step) const {
  ElasticLattice out;
  out.size = (grid_.size.array() + step - 1) / step;
  out.rest_spacing_mm = step * grid_.spacing_mm;
  out.handedness = grid_.direction.determinant() < 0 ? -1 : 1;
  for (int k = 0; k < grid_.size.z(); k += step) {
    for (int j = 0; j < grid_.size.y(); j += step) {
      for (int i = 0; i < grid_.size.x(); i += step) {
        const size_t v = grid_.Index(i, j, k);
        out.kinds.push_back(kinds_[v]);
        out.joined.push_back(Joined(kinds_, grid_, {i, j, k}, step));
        out.positions_mm.push_back(scan_mm[v]);
      }
    }
  }
  return out;
}

// Linearly between the nodes.
void ElasticTissue::AddMoved(const ElasticLattice& lattice, int step,
                             std::vector<Eigen::Vector3f>& scan_mm) const {
  std::vector<Eigen::Vector3f> moved(lattice.positions_mm.size());
  for (size_t n = 0; n < moved.size(); ++n) {
    const Eigen::Vector3i p = step * NodeAt(lattice, n);
    moved[n] = lattice.positions_mm[n] - scan_mm[grid_.Index(p.x(), p.y(), p.z())];
  }
  ParallelRanges(scan_mm.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      if (kinds_[v] != NodeKind::kFree) continue;
      const Eigen::Vector3i p = grid_.Ijk(v), lo = p / step;
      const Eigen::Vector3f f = (p - lo * step).cast<float>() / float(step);
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      float share = 0;
      for (int c = 0; c < 8; ++c) {
        const Eigen::Vector3i n = lo + Eigen::Vector3i(c & 1, c >> 1 & 1, c >> 2);
        const float w =
            (c & 1 ? f.x() : 1 - f.x()) * (c & 2 ? f.y() : 1 - f.y()) * (c & 4 ? f.z() : 1 - f.z());
        if (w <= 0 || (n.array() >= lattice.size.array()).any()) continue;
        const size_t at = lattice.Index(n.x(), n.y(), n.z());
        if (lattice.kinds[at] == NodeKind::kAbsent) continue;
        sum += w * moved[at];
        share += w;
      }
      if (share > 0) scan_mm[v] += sum / share;
    }
  });
}

void ElasticTissue::CarryAir(const std::vector<Eigen::Vector3f>& before,
                             std::vector<Eigen::Vector3f>& scan_mm) const {
  ParallelRanges(scan_mm.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      const uint32_t tissue = nearest_tissue_[v];
      if (kinds_[v] == NodeKind::kAbsent) scan_mm[v] += scan_mm[tissue] - before[tissue];
    }
  });
}

}  // namespace kvx
