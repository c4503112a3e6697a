// Coarse lattices first: what they move is added to the finer ones.
// What is folded after that is repaired voxel by voxel.
#include "pipeline/registration/elastic_start.h"

#include <algorithm>

#include "core/parallel.h"
#include "pipeline/registration/blend_table.h"
#include "pipeline/registration/elastic_relaxation.h"
#include "pipeline/registration/fold_repair.h"
#include "pipeline/skinning/nearest_voxel.h"

namespace kvx {
namespace {

// Every how many voxels a node, and sweeps over the nodes.
constexpr struct { int step, sweeps; } kLattices[] = {{4, 40}, {2, 15}};

struct Material {
  std::vector<NodeKind> kinds;
  Mask tissue;
};

Material MaterialOf(const LabelMap& bone_labels, const Mask& body, const WorkRegion& region) {
  Material out{std::vector<NodeKind>(region.grid.VoxelCount(), NodeKind::kAbsent), Mask(region.grid)};
  for (size_t v = 0; v < out.kinds.size(); ++v) {
    const Eigen::Vector3i p = region.grid.Ijk(v) + region.first;
    if (!body.grid.Contains(p) || !body(p.x(), p.y(), p.z())) continue;
    out.tissue.values[v] = 1;
    out.kinds[v] = bone_labels(p.x(), p.y(), p.z()) ? NodeKind::kFixed : NodeKind::kFree;
  }
  return out;
}

std::vector<Eigen::Vector3f> Skinned(const WeightMap& weights, const PoseVector& pose,
                                     const WorkRegion& region) {
  const BlendTable blend(pose);
  std::vector<Eigen::Vector3f> out(region.grid.VoxelCount());
  ParallelRanges(out.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      const Eigen::Vector3i at = region.grid.Ijk(v) + region.first;
      const Eigen::Vector3i p = at.cwiseMax(0).cwiseMin((weights.grid.size.array() - 1).matrix());
      const Eigen::Vector3d x = weights.grid.ToMm(at.x(), at.y(), at.z()).lps;
      out[v] = Apply(blend(weights(p.x(), p.y(), p.z())), x).cast<float>();
    }
  });
  return out;
}

// Per axis, whether there is tissue from voxel `p` on for `step` voxels.
uint8_t Joined(const Mask& tissue, const Eigen::Vector3i& p, int step) {
  uint8_t out = 0;
  for (int axis = 0; axis < 3; ++axis) {
    bool whole = p[axis] + step < tissue.grid.size[axis];
    for (int n = 0; whole && n <= step; ++n) {
      const Eigen::Vector3i q = p + n * Eigen::Vector3i::Unit(axis);
      whole = tissue(q.x(), q.y(), q.z());
    }
    out |= uint8_t(whole) << axis;
  }
  return out;
}

// Every step-th voxel.
ElasticLattice Subsampled(const Material& material, const std::vector<Eigen::Vector3f>& positions,
                          const Grid& grid, int step) {
  ElasticLattice out;
  out.size = (grid.size.array() + step - 1) / step;
  out.rest_spacing_mm = step * grid.spacing_mm;
  out.handedness = grid.direction.determinant() < 0 ? -1 : 1;
  for (int k = 0; k < grid.size.z(); k += step) {
    for (int j = 0; j < grid.size.y(); j += step) {
      for (int i = 0; i < grid.size.x(); i += step) {
        const size_t v = grid.Index(i, j, k);
        out.kinds.push_back(material.kinds[v]);
        out.joined.push_back(Joined(material.tissue, {i, j, k}, step));
        out.positions_mm.push_back(positions[v]);
      }
    }
  }
  return out;
}

// Adds to the free voxels what the lattice's nodes have moved, linearly in between.
void AddMoved(const ElasticLattice& lattice, int step, const Material& material, const Grid& grid,
              std::vector<Eigen::Vector3f>& positions) {
  std::vector<Eigen::Vector3f> moved(lattice.positions_mm.size());
  for (size_t n = 0; n < moved.size(); ++n) {
    const Eigen::Vector3i p(int(n % lattice.size.x()), int(n / lattice.size.x() % lattice.size.y()),
                            int(n / (size_t(lattice.size.x()) * lattice.size.y())));
    moved[n] = lattice.positions_mm[n] - positions[grid.Index(p.x() * step, p.y() * step, p.z() * step)];
  }
  ParallelRanges(positions.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      if (material.kinds[v] != NodeKind::kFree) continue;
      const Eigen::Vector3i p = grid.Ijk(v), lo = p / step;
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
      if (share > 0) positions[v] += sum / share;
    }
  });
}

// Air moves with the tissue nearest to it.
void CarryAir(const Mask& tissue, const std::vector<Eigen::Vector3f>& skinned,
              std::vector<Eigen::Vector3f>& positions) {
  const std::vector<uint32_t> nearest = NearestMarked(tissue);
  ParallelRanges(positions.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      if (!tissue.values[v]) positions[v] = skinned[v] + positions[nearest[v]] - skinned[nearest[v]];
    }
  });
}

}  // namespace

std::vector<Eigen::Vector3f> ElasticStart(const WeightMap& weights, const LabelMap& bone_labels,
                                          const Mask& body, const PoseVector& scan_from_template,
                                          const WorkRegion& region) {
  const Material material = MaterialOf(bone_labels, body, region);
  const std::vector<Eigen::Vector3f> skinned = Skinned(weights, scan_from_template, region);
  std::vector<Eigen::Vector3f> positions = skinned;
  for (const auto& [step, sweeps] : kLattices) {
    ElasticLattice lattice = Subsampled(material, positions, region.grid, step);
    Relax(lattice, sweeps);
    AddMoved(lattice, step, material, region.grid, positions);
  }
  CarryAir(material.tissue, skinned, positions);
  Unfold(bone_labels, body, region, positions);
  return positions;
}

}  // namespace kvx
