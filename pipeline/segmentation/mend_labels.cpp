// One flood fill over all labels; holes bone by bone.
#include "pipeline/segmentation/mend_labels.h"

#include <algorithm>

#include "core/voxels/components.h"
#include "core/voxels/voxel_box.h"

namespace kvx {
namespace {

constexpr size_t kSmallPart = 100;  // a piece is stray below one such part of its label
constexpr size_t kFewVoxels = 4;    // or below so many voxels,
constexpr size_t kFewPart = 10;     // where these are no larger part
constexpr size_t kMostLabels = size_t(1) << 16;

// A piece of a label of so many voxels is stray if it is smaller.
size_t LeastPiece(size_t voxels_of_label) {
  return std::max(voxels_of_label / kSmallPart, std::min(kFewVoxels, voxels_of_label / kFewPart + 1));
}

class Flood {
 public:
  explicit Flood(const LabelMap& labels) : labels_(labels), seen_(labels.values.size(), false) {}

  // The voxels of a piece that was not seen before; empty where it was.
  const std::vector<size_t>& From(size_t seed) {
    piece_.clear();
    Take(seed);
    for (size_t n = 0; n < piece_.size(); ++n) Spread(piece_[n]);
    return piece_;
  }

 private:
  void Take(size_t at) {
    if (seen_[at]) return;
    seen_[at] = true;
    piece_.push_back(at);
  }
  void Spread(size_t from) {
    const Grid& grid = labels_.grid;
    const Eigen::Vector3i p = grid.Ijk(from);
    const VoxelBox around = VoxelBox{p, p + Eigen::Vector3i::Ones()}.Grown(Eigen::Vector3i::Ones(), grid);
    ForEachVoxel(around, [&](const Eigen::Vector3i& q) {
      const size_t at = grid.Index(q.x(), q.y(), q.z());
      if (labels_.values[at] == labels_.values[from]) Take(at);
    });
  }

  const LabelMap& labels_;
  std::vector<bool> seen_;
  std::vector<size_t> piece_;
};

// Of a label in its box, with a frame of background around it: no hole is closed by the grid's border.
Mask FramedMask(const LabelMap& labels, int label, const VoxelBox& box) {
  Grid grid = GridOf(box, labels.grid);
  grid.origin = grid.ToMm(-1, -1, -1);
  grid.size += Eigen::Vector3i::Constant(2);
  Mask out(grid);
  ForEachVoxel(box, labels.grid, [&](const Eigen::Vector3i& p, size_t, size_t whole) {
    out(p.x() + 1, p.y() + 1, p.z() + 1) = labels.values[whole] == label;
  });
  return out;
}

}  // namespace

VoxelsByLabel StrayVoxels(const LabelMap& labels) {
  std::vector<size_t> voxels(kMostLabels, 0);
  for (const uint16_t label : labels.values) ++voxels[label];
  VoxelsByLabel strays;
  Flood flood(labels);
  for (size_t v = 0; v < labels.values.size(); ++v) {
    const int label = labels.values[v];
    if (label == 0) continue;
    const std::vector<size_t>& piece = flood.From(v);
    if (piece.empty() || piece.size() >= LeastPiece(voxels[size_t(label)])) continue;
    std::vector<size_t>& all = strays[label];
    all.insert(all.end(), piece.begin(), piece.end());
  }
  std::erase_if(strays, [&](const auto& of) { return 2 * of.second.size() > voxels[size_t(of.first)]; });
  return strays;
}

VoxelsByLabel EnclosedVoxels(const LabelMap& labels) {
  VoxelsByLabel enclosed;
  for (const auto& [label, box] : BoxesOf(labels)) {
    const Mask bone = FramedMask(labels, label, box), full = FillHoles(bone);
    std::vector<size_t> holes;
    ForEachVoxel(box, labels.grid, [&](const Eigen::Vector3i& p, size_t, size_t whole) {
      const size_t framed = bone.grid.Index(p.x() + 1, p.y() + 1, p.z() + 1);
      if (full.values[framed] && labels.values[whole] == 0) holes.push_back(whole);
    });
    if (!holes.empty()) enclosed[label] = std::move(holes);
  }
  return enclosed;
}

VoxelsByLabel FillEnclosed(LabelMap& labels) {
  VoxelsByLabel enclosed = EnclosedVoxels(labels);
  for (const auto& [label, voxels] : enclosed) {
    for (const size_t v : voxels) labels.values[v] = uint16_t(label);
  }
  return enclosed;
}

MendedLabels MendLabels(LabelMap labels) {
  MendedLabels out{std::move(labels), {}, {}};
  out.strays = StrayVoxels(out.labels);
  for (const auto& [label, voxels] : out.strays) {
    for (const size_t v : voxels) out.labels.values[v] = 0;
  }
  out.filled = FillEnclosed(out.labels);
  return out;
}

}  // namespace kvx
