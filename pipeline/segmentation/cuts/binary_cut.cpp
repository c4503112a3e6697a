// Voxels whose side is known are no nodes: what their links cost goes to the terminals of their neighbours.
#include "pipeline/segmentation/cuts/binary_cut.h"

#include <algorithm>
#include <cmath>

#include "core/voxels/voxel_box.h"

namespace kvx {
namespace {

constexpr double kUnitsPerNat = 1000;
constexpr double kMostNats = 1000;

VoxelBox FreeBox(const std::vector<CutLayer>& layers) {
  VoxelBox box;
  for (const CutLayer& layer : layers) {
    for (size_t v = 0; v < layer.sides.values.size(); ++v) {
      if (layer.sides.values[v] == Side::kFree) box.Include(layer.sides.grid.Ijk(v));
    }
  }
  return box;
}

std::vector<uint8_t> FreeIn(const VoxelBox& box, const std::vector<CutLayer>& layers) {
  std::vector<uint8_t> free;
  free.reserve(layers.size() * GridOf(box, layers.front().sides.grid).VoxelCount());
  for (const CutLayer& layer : layers) {
    ForEachVoxel(box, layer.sides.grid, [&](const Eigen::Vector3i&, size_t, size_t at) {
      free.push_back(layer.sides.values[at] == Side::kFree);
    });
  }
  return free;
}

class CutBuilder {
 public:
  CutBuilder(const std::vector<CutLayer>& layers, const Volume& relative, const VoxelBox& box)
      : layers_(layers),
        relative_(relative),
        box_(box),
        lattice_(box.size(), layers.front().links.neighbours, FreeIn(box, layers), int(layers.size())),
        areas_(LinkAreas(lattice_, relative.grid.spacing_mm)) {}

  std::vector<Mask> Solve() {
    std::vector<Mask> inside(layers_.size(), Mask(relative_.grid));
    ForEachFree([&](size_t l, const Eigen::Vector3i& v, size_t at) { AddVoxel(l, v, at); });
    lattice_.Solve();
    for (size_t l = 0; l < layers_.size(); ++l) {
      for (size_t v = 0; v < inside[l].values.size(); ++v)
        inside[l].values[v] = layers_[l].sides.values[v] == Side::kInside;
    }
    ForEachFree([&](size_t l, const Eigen::Vector3i& v, size_t at) {
      inside[l].values[at] = lattice_.OnSourceSide(InLayer(l, v));
    });
    return inside;
  }

 private:
  template <class Visit>
  void ForEachFree(Visit&& visit) const {
    for (size_t l = 0; l < layers_.size(); ++l) {
      ForEachVoxel(box_, relative_.grid, [&](const Eigen::Vector3i& v, size_t, size_t at) {
        if (layers_[l].sides.values[at] == Side::kFree) visit(l, v, at);
      });
    }
  }

  Eigen::Vector3i InLayer(size_t layer, const Eigen::Vector3i& v) const {
    return v + int(layer) * box_.size().z() * Eigen::Vector3i::UnitZ();
  }

  double LinkNats(const LinkOptions& links, size_t inside, size_t outside, int direction) const {
    double fall = double(relative_.values[inside]) - relative_.values[outside];
    if (links.falls_outwards != 0) fall = std::max(0.0, fall * links.falls_outwards);
    const double z = fall / links.contrast;
    return links.strength * areas_[direction] * std::exp(-0.5 * z * z);
  }

  void AddVoxel(size_t l, const Eigen::Vector3i& v, size_t at) {
    const CutLayer& layer = layers_[l];
    const Grid& grid = relative_.grid;
    double cost = layer.inside_cost.values[at] + Nesting(l, v, at);
    for (int d = 0; d < lattice_.directions(); ++d) {
      const Eigen::Vector3i next = v + box_.low + lattice_.Step(d);
      if (!grid.Contains(next)) continue;
      const size_t other = grid.Index(next.x(), next.y(), next.z());
      if (layer.sides.values[other] == Side::kFree)
        lattice_.SetLink(InLayer(l, v), d, CutUnits(LinkNats(layer.links, at, other, d)));
      else if (layer.sides.values[other] == Side::kInside)
        cost -= LinkNats(layer.links, other, at, d);
      else
        cost += LinkNats(layer.links, at, other, d);
    }
    lattice_.AddTerminal(InLayer(l, v), CutUnits(cost));
  }

  // Inside this layer is inside the next.
  double Nesting(size_t l, const Eigen::Vector3i& v, size_t at) {
    double cost = 0;
    if (l > 0 && layers_[l - 1].sides.values[at] == Side::kInside) cost -= kMostNats;
    if (l + 1 == layers_.size()) return cost;
    if (layers_[l + 1].sides.values[at] == Side::kOutside) cost += kMostNats;
    if (layers_[l + 1].sides.values[at] == Side::kFree)
      lattice_.SetLinkToNextLayer(InLayer(l, v), CutUnits(kMostNats));
    return cost;
  }

  const std::vector<CutLayer>& layers_;
  const Volume& relative_;
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

std::vector<Mask> NestedCut(const std::vector<CutLayer>& layers, const Volume& relative) {
  return CutBuilder(layers, relative, FreeBox(layers)).Solve();
}

Mask MinimumCut(CutLayer layer, const Volume& relative) {
  std::vector<CutLayer> layers;
  layers.push_back(std::move(layer));
  return std::move(NestedCut(layers, relative).front());
}

}  // namespace kvx
