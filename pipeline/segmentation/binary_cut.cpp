// Voxels whose side is known are no nodes: what their links cost goes to the terminals of their neighbours.
#include "pipeline/segmentation/binary_cut.h"

#include <algorithm>
#include <cmath>

#include "core/voxel_box.h"

namespace kvx {
namespace {

constexpr double kUnitsPerNat = 1000;
constexpr double kMostNats = 1000;

std::vector<uint8_t> FreeIn(const VoxelBox& box, const Image<Side>& sides) {
  std::vector<uint8_t> free;
  free.reserve(GridOf(box, sides.grid).VoxelCount());
  ForEachVoxel(box, sides.grid, [&](const Eigen::Vector3i&, size_t, size_t at) {
    free.push_back(sides.values[at] == Side::kFree);
  });
  return free;
}

class CutBuilder {
 public:
  CutBuilder(const Image<float>& cost, const Image<Side>& sides, const Volume& relative,
             const LinkOptions& options, const VoxelBox& box)
      : cost_(cost),
        sides_(sides),
        relative_(relative),
        options_(options),
        box_(box),
        lattice_(box.size(), options.neighbours, FreeIn(box, sides)),
        areas_(LinkAreas(lattice_, cost.grid.spacing_mm)) {}

  LatticeCut& Build() {
    ForEachVoxel(box_, cost_.grid, [&](const Eigen::Vector3i& v, size_t, size_t at) {
      if (sides_.values[at] == Side::kFree) AddVoxel(v, at);
    });
    return lattice_;
  }

 private:
  double LinkNats(size_t inside, size_t outside, int direction) const {
    double fall = double(relative_.values[inside]) - relative_.values[outside];
    if (options_.falls_outwards != 0) fall = std::max(0.0, fall * options_.falls_outwards);
    const double z = fall / options_.contrast;
    return options_.strength * areas_[direction] * std::exp(-0.5 * z * z);
  }

  void AddVoxel(const Eigen::Vector3i& v, size_t at) {
    double cost = cost_.values[at];
    for (int d = 0; d < lattice_.directions(); ++d) {
      const Eigen::Vector3i next = v + box_.low + lattice_.Step(d);
      if (!cost_.grid.Contains(next)) continue;
      const size_t other = cost_.grid.Index(next.x(), next.y(), next.z());
      if (sides_.values[other] == Side::kFree)
        lattice_.SetLink(v, d, CutUnits(LinkNats(at, other, d)));
      else if (sides_.values[other] == Side::kInside)
        cost -= LinkNats(other, at, d);
      else
        cost += LinkNats(at, other, d);
    }
    lattice_.AddTerminal(v, CutUnits(cost));
  }

  const Image<float>& cost_;
  const Image<Side>& sides_;
  const Volume& relative_;
  const LinkOptions& options_;
  const VoxelBox box_;
  LatticeCut lattice_;
  const std::vector<double> areas_;
};

}  // namespace

int32_t CutUnits(double nats) {
  return int32_t(std::lround(kUnitsPerNat * std::clamp(nats, -kMostNats, kMostNats)));
}

std::vector<double> LinkAreas(const LatticeCut& lattice, const Eigen::Vector3d& spacing_mm) {
  std::vector<double> areas;
  const double mean = std::cbrt(spacing_mm.prod());
  double across = 0;  // of a cut across the first axis
  for (int d = 0; d < lattice.directions(); ++d) {
    const Eigen::Vector3d step = lattice.Step(d).cast<double>();
    areas.push_back(mean / step.cwiseProduct(spacing_mm).norm());
    if (step.x() > 0) across += 1 / step.norm();
  }
  for (double& area : areas) area /= across;
  return areas;
}

Mask MinimumCut(const Image<float>& inside_cost, const Image<Side>& sides, const Volume& relative,
                const LinkOptions& options) {
  Mask inside(sides.grid);
  VoxelBox free;
  for (size_t v = 0; v < sides.values.size(); ++v) {
    inside.values[v] = sides.values[v] == Side::kInside;
    if (sides.values[v] == Side::kFree) free.Include(sides.grid.Ijk(v));
  }
  if (free.empty()) return inside;
  CutBuilder builder(inside_cost, sides, relative, options, free);
  LatticeCut& lattice = builder.Build();
  lattice.Solve();
  ForEachVoxel(free, sides.grid, [&](const Eigen::Vector3i& v, size_t, size_t at) {
    if (sides.values[at] == Side::kFree) inside.values[at] = lattice.OnSourceSide(v);
  });
  return inside;
}

}  // namespace kvx
