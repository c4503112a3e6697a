// Each move is a minimum cut: source is to take the label, sink to keep the old one.
#include "pipeline/segmentation/cuts/label_cut.h"

#include <cmath>
#include <set>

#include "core/voxels/voxel_box.h"
#include "pipeline/segmentation/cuts/binary_cut.h"

namespace kvx {
namespace {

constexpr int kMostRounds = 3;
constexpr int kNeighbours = 18;

// One label's move.
class Expansion {
 public:
  Expansion(LabelMap& labels, const LabelCosts& costs, uint16_t label)
      : labels_(labels), costs_(costs), label_(label) {
    for (size_t v = 0; v < labels.values.size(); ++v) {
      if (MayTake(v)) box_.Include(labels.grid.Ijk(v));
    }
  }

  size_t Move() {
    if (box_.empty()) return 0;
    std::vector<uint8_t> part;
    ForEachVoxel(box_, labels_.grid, [&](const auto&, size_t, size_t v) { part.push_back(MayTake(v)); });
    LatticeCut lattice(box_.size(), kNeighbours, part);
    areas_ = LinkAreas(lattice, labels_.grid.spacing_mm);
    ForEachVoxel(box_, labels_.grid, [&](const Eigen::Vector3i& p, size_t in_box, size_t v) {
      if (part[in_box]) AddVoxel(lattice, p, v);
    });
    lattice.Solve();
    size_t moved = 0;
    ForEachVoxel(box_, labels_.grid, [&](const Eigen::Vector3i& p, size_t in_box, size_t v) {
      if (!part[in_box] || !lattice.OnSourceSide(p)) return;
      labels_.values[v] = label_;
      ++moved;
    });
    return moved;
  }

 private:
  bool MayTake(size_t v) const {
    return labels_.values[v] != 0 && labels_.values[v] != label_ && std::isfinite(costs_.nats(label_, v));
  }

  void AddVoxel(LatticeCut& lattice, const Eigen::Vector3i& p, size_t v) const {
    const int old = labels_.values[v];
    double take = costs_.nats(label_, v), keep = costs_.nats(uint16_t(old), v);
    for (int d = 0; d < lattice.directions(); ++d) {
      const Eigen::Vector3i next = p + box_.low + lattice.Step(d);
      if (!labels_.grid.Contains(next)) continue;
      const size_t other = labels_.grid.Index(next.x(), next.y(), next.z());
      if (labels_.values[other] == 0) continue;
      const double seam = areas_[d] * costs_.seam_root.values[v] * costs_.seam_root.values[other];
      const bool same = labels_.values[other] == old, first = d < lattice.directions() / 2;
      if (labels_.values[other] == label_) {
        keep += seam;
      } else if (!MayTake(other)) {
        if (same) take += seam;
      } else {
        // A seam that is there already stays unless both take the label; one of the two counts it.
        if (same || first) lattice.SetLink(p, d, CutUnits(seam));
        if (!same && first) keep += seam;
      }
    }
    lattice.AddTerminal(p, CutUnits(take - keep));
  }

  LabelMap& labels_;
  const LabelCosts& costs_;
  const uint16_t label_;
  VoxelBox box_;  // of what may take the label
  std::vector<double> areas_;
};

}  // namespace

LabelMap CheapestLabels(LabelMap labels, const LabelCosts& costs) {
  std::set<uint16_t> all(labels.values.begin(), labels.values.end());
  all.erase(0);
  for (int round = 0; round < kMostRounds; ++round) {
    size_t moved = 0;
    for (const uint16_t label : all) moved += Expansion(labels, costs, label).Move();
    if (moved == 0) break;
  }
  return labels;
}

}  // namespace kvx
