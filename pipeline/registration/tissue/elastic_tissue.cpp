// Coarse lattices first, every step-th voxel a node: what they move is added to the voxels between them and
// to the finer lattices. Beside bones every voxel is a node in the end: there, and in the gaps of joints, a
// voxel is as wide as what it has to tell apart.
#include "pipeline/registration/tissue/elastic_tissue.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "core/voxels/nearest_voxel.h"
#include "core/voxels/to_corner.h"

namespace kvx {
namespace {

// Every how many voxels the coarsest lattice has a node, unless the region has room for a coarser one: where
// voxels are small, tissue has as many more nodes to settle.
constexpr int kUsualStep = 4;
constexpr int kLeastNodes = 24;  // of the coarsest lattice, along the region's longest side
constexpr int kFinestStep = 2;
constexpr int kSweepsCoarsest = 40, kSweepsBetween = 60, kSweepsFinest = 30;
constexpr int kSweepsBesideBones = 10;
constexpr double kBesideBonesVoxels = 3;  // beyond their coat
constexpr double kCoatStiffness = 10;
constexpr double kStillSpacings = 3e-4;  // between nodes: what moves less in a sweep is at ease

struct LatticeSweeps {
  int step, sweeps;
};

std::vector<LatticeSweeps> CoarseToFine(const Grid& grid) {
  int coarsest = kUsualStep;
  while (grid.size.maxCoeff() / (2 * coarsest) >= kLeastNodes) coarsest *= 2;
  std::vector<LatticeSweeps> out{{coarsest, kSweepsCoarsest}};
  for (int step = coarsest / 2; step > kFinestStep; step /= 2) out.push_back({step, kSweepsBetween});
  out.push_back({kFinestStep, kSweepsFinest});
  return out;
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
std::vector<Eigen::Matrix3f> NodeHolds(std::span<const Eigen::Matrix3f> holds, const Grid& cells, int step,
                                       const ElasticLattice& lattice) {
  const int wide = step / 2;  // cells per node and axis
  std::vector<Eigen::Matrix3f> out(lattice.positions_mm.size(), Eigen::Matrix3f::Zero());
  ParallelEach(out.size(), [&](size_t n) {
    const Eigen::Vector3i first = wide * lattice.NodeAt(n) - Eigen::Vector3i::Constant(wide / 2);
    for (int c = 0; c < wide * wide * wide; ++c) {
      const Eigen::Vector3i p = first + Eigen::Vector3i(c % wide, c / wide % wide, c / (wide * wide));
      if (cells.Contains(p)) out[n] += holds[cells.Index(p.x(), p.y(), p.z())];
    }
    out[n] /= float(wide * wide * wide);
  });
  return out;
}

Mask AirOf(const Mask& body, const WorkRegion& region) {
  Mask air = Crop(body, region);
  for (uint8_t& voxel : air.values) voxel = !voxel;
  return air;
}

}  // namespace

ElasticTissue::ElasticTissue(const LabelMap& bone_labels, const Mask& body, const Volume& beyond_coat_mm,
                             const WorkRegion& region, Backend& backend)
    : sweeps_(backend),
      grid_(region.grid),
      kinds_(region.grid.VoxelCount(), NodeKind::kAbsent),
      beyond_coat_mm_(beyond_coat_mm),
      contact_(AirOf(body, region)) {
  Mask tissue(region.grid);
  ParallelEach(kinds_.size(), [&](size_t v) {
    const Eigen::Vector3i p = region.grid.Ijk(v) + region.first;
    if (!body.grid.Contains(p) || !body(p.x(), p.y(), p.z())) return;
    tissue.values[v] = 1;
    kinds_[v] = bone_labels(p.x(), p.y(), p.z()) ? NodeKind::kFixed : NodeKind::kFree;
  });
  nearest_tissue_ = NearestMarked(tissue);
  const double reach_mm = kBesideBonesVoxels * grid_.spacing_mm.maxCoeff();
  for (size_t v = 0; v < kinds_.size(); ++v)
    if (kinds_[v] == NodeKind::kFree && beyond_coat_mm.values[v] <= reach_mm)
      beside_bones_.push_back(uint32_t(v));
}

void ElasticTissue::Relax(std::span<const Eigen::Matrix3f> holds, const Progress& progress,
                          std::vector<Eigen::Vector3f>& scan_mm) const {
  const std::vector<Eigen::Vector3f> before = scan_mm;
  for (const auto& [step, sweeps] : CoarseToFine(grid_)) {
    ElasticLattice lattice = Subsampled(scan_mm, step);
    std::vector<Eigen::Matrix3f> node_holds;
    std::vector<Eigen::Vector3f> held_mm;
    if (!holds.empty()) {
      node_holds = NodeHolds(holds, Coarsened(grid_, 2), step, lattice);
      held_mm = Subsampled(before, step).positions_mm;
      lattice.holds = node_holds, lattice.held_mm = held_mm;
    }
    RelaxInContact(sweeps_, contact_, step, sweeps, progress, lattice);
    AddMoved(lattice, step, scan_mm);
  }
  RelaxBesideBones(holds, before, scan_mm);
  CarryAir(before, scan_mm);
}

void ElasticTissue::RelaxBesideBones(std::span<const Eigen::Matrix3f> holds,
                                     const std::vector<Eigen::Vector3f>& held_mm,
                                     std::vector<Eigen::Vector3f>& scan_mm) const {
  ElasticLattice lattice = Empty(1);
  lattice.kinds = kinds_;
  lattice.stiffness = CoatStiffness();
  lattice.joined.resize(kinds_.size());
  ParallelEach(kinds_.size(), [&](size_t v) { lattice.joined[v] = Joined(kinds_, grid_, grid_.Ijk(v), 1); });
  if (!holds.empty()) {
    lattice.holds = holds;
    lattice.hold_nodes = 2;
    lattice.held_mm = held_mm;
  }
  lattice.positions_mm = std::move(scan_mm);
  sweeps_(lattice, kSweepsBesideBones, beside_bones_);
  scan_mm = std::move(lattice.positions_mm);
}

// What lies between a node and the next, a voxel away, is partly coat: they stretch one after the other. Of a
// bone's outermost nodes half of the way is bone.
std::vector<float> ElasticTissue::CoatStiffness() const {
  const double voxel_mm = grid_.spacing_mm.maxCoeff();
  std::vector<float> out(kinds_.size(), 1);
  ParallelEach(out.size(), [&](size_t v) {
    if (beyond_coat_mm_.values[v] >= 0) return;
    const double way_mm = kinds_[v] == NodeKind::kFixed ? 0.5 * voxel_mm : voxel_mm;
    const double coat = std::min(1.0, -beyond_coat_mm_.values[v] / way_mm);
    out[v] = float(1 / (1 - coat + coat / kCoatStiffness));
  });
  return out;
}

ElasticLattice ElasticTissue::Empty(int step) const {
  ElasticLattice out;
  out.size = (grid_.size.array() + step - 1) / step;
  out.rest_spacing_mm = step * grid_.spacing_mm;
  out.still_mm = float(kStillSpacings * out.rest_spacing_mm.mean());
  out.handedness = grid_.direction.determinant() < 0 ? -1 : 1;
  return out;
}

ElasticLattice ElasticTissue::Subsampled(const std::vector<Eigen::Vector3f>& scan_mm, int step) const {
  ElasticLattice out = Empty(step);
  const size_t nodes = size_t(out.size.x()) * size_t(out.size.y()) * size_t(out.size.z());
  out.kinds.resize(nodes);
  out.joined.resize(nodes);
  out.positions_mm.resize(nodes);
  ParallelEach(nodes, [&](size_t n) {
    const Eigen::Vector3i p = step * out.NodeAt(n);
    const size_t v = grid_.Index(p.x(), p.y(), p.z());
    out.kinds[n] = kinds_[v];
    out.joined[n] = Joined(kinds_, grid_, p, step);
    out.positions_mm[n] = scan_mm[v];
  });
  return out;
}

// Linearly between the nodes.
void ElasticTissue::AddMoved(const ElasticLattice& lattice, int step,
                             std::vector<Eigen::Vector3f>& scan_mm) const {
  std::vector<Eigen::Vector3f> moved(lattice.positions_mm.size());
  ParallelEach(moved.size(), [&](size_t n) {
    const Eigen::Vector3i p = step * lattice.NodeAt(n);
    moved[n] = lattice.positions_mm[n] - scan_mm[grid_.Index(p.x(), p.y(), p.z())];
  });
  ParallelEach(scan_mm.size(), [&](size_t v) {
    if (kinds_[v] != NodeKind::kFree) return;
    const Eigen::Vector3i p = grid_.Ijk(v), lo = p / step;
    const Eigen::Vector3f f = (p - lo * step).cast<float>() / float(step);
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float share = 0;
    for (int c = 0; c < 8; ++c) {
      const Eigen::Vector3i n = lo + ToCorner(c);
      const float w = (c & 1 ? f.x() : 1 - f.x()) * (c & 2 ? f.y() : 1 - f.y()) * (c & 4 ? f.z() : 1 - f.z());
      if (w <= 0 || (n.array() >= lattice.size.array()).any()) continue;
      const size_t at = lattice.Index(n.x(), n.y(), n.z());
      if (lattice.kinds[at] == NodeKind::kAbsent) continue;
      sum += w * moved[at];
      share += w;
    }
    if (share > 0) scan_mm[v] += sum / share;
  });
}

void ElasticTissue::CarryAir(const std::vector<Eigen::Vector3f>& before,
                             std::vector<Eigen::Vector3f>& scan_mm) const {
  ParallelEach(scan_mm.size(), [&](size_t v) {
    const uint32_t tissue = nearest_tissue_[v];
    if (kinds_[v] == NodeKind::kAbsent) scan_mm[v] += scan_mm[tissue] - before[tissue];
  });
}

}  // namespace kvx
