// Most bones are one piece by faces already, and few strokes lie beside another bone: the rest is looked at
// only where this is not so.
#include "pipeline/segmentation/strokes/stroke_doubts.h"

#include <algorithm>
#include <array>
#include <vector>

#include "core/voxels/components.h"
#include "core/voxels/neighbours.h"

namespace kvx {
namespace {

constexpr int kInsideWays = 5;  // of six: a stroke that sticks out of a bone has one way out

// The largest piece by faces, and all that touches it.
Mask MainPiece(const Mask& bone) {
  const Components pieces = LabelComponents(bone);
  if (pieces.voxels.size() < 2) return bone;
  const auto largest = int32_t(std::ranges::max_element(pieces.voxels) - pieces.voxels.begin());
  Mask main(bone.grid);
  std::vector<size_t> reached;
  const auto take = [&](size_t v) { main.values[v] = 1, reached.push_back(v); };
  for (size_t v = 0; v < bone.values.size(); ++v)
    if (pieces.piece.values[v] == largest) take(v);
  for (size_t n = 0; n < reached.size(); ++n) {
    ForEachNeighbour(bone.grid, reached[n], [&](size_t beside) {
      if (bone.values[beside] && !main.values[beside]) take(beside);
    });
  }
  return main;
}

// The labels that come after a stroke on the ways along the axes; 0 where the view ends.
std::array<int, 6> LabelsAround(const LabelMap& labels, const LabelMap& strokes, const Eigen::Vector3i& at) {
  std::array<int, 6> around{};
  const uint16_t stroke = strokes(at.x(), at.y(), at.z());
  for (int way = 0; way < 6; ++way) {
    const Eigen::Vector3i step = StepToSide(way);
    Eigen::Vector3i p = at + step;
    while (strokes.grid.Contains(p) && strokes(p.x(), p.y(), p.z()) == stroke) p += step;
    if (strokes.grid.Contains(p)) around[size_t(way)] = labels(p.x(), p.y(), p.z());
  }
  return around;
}

bool IsBesideABone(const LabelMap& labels, const Eigen::Vector3i& at, int but) {
  for (int way = 0; way < 6; ++way) {
    const Eigen::Vector3i p = at + StepToSide(way);
    if (!labels.grid.Contains(p)) continue;
    const int label = labels(p.x(), p.y(), p.z());
    if (label != 0 && label != but) return true;
  }
  return false;
}

}  // namespace

size_t StrokesApart(const LabelMap& labels, const LabelMap& strokes, int label, const VoxelBox& box) {
  Mask bone(GridOf(box, labels.grid));
  ForEachVoxel(box, labels.grid, [&](const auto&, size_t part, size_t whole) {
    bone.values[part] = labels.values[whole] == label;
  });
  const Mask main = MainPiece(bone);
  size_t apart = 0;
  ForEachVoxel(box, labels.grid, [&](const auto&, size_t part, size_t whole) {
    apart += bone.values[part] && !main.values[part] && strokes.values[whole] == label;
  });
  return apart;
}

std::map<int, size_t> StrokesWithin(const LabelMap& labels, const LabelMap& strokes) {
  std::map<int, size_t> within;
  for (size_t v = 0; v < strokes.values.size(); ++v) {
    const int stroke = strokes.values[v];
    if (stroke == 0) continue;
    const Eigen::Vector3i at = strokes.grid.Ijk(v);
    if (!IsBesideABone(labels, at, stroke)) continue;
    const std::array<int, 6> around = LabelsAround(labels, strokes, at);
    for (const int way : {0, 1}) {  // one of any two ways leads to a bone that five lead to
      const int bone = around[size_t(way)];
      if (bone == 0 || bone == stroke || std::ranges::count(around, bone) < kInsideWays) continue;
      ++within[bone];
      break;
    }
  }
  return within;
}

}  // namespace kvx
