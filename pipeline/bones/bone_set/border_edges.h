// Whether the borders of a label map lie on edges of the scan that it was made on, whatever the contrast.
#pragma once
#include <optional>

#include "core/image.h"

namespace kvx {

// Of a label map on its scan's grid. A score is the mean over border voxels of how much of the scan's
// gradient lies along the border's normal: 0 to 1.
struct BorderEdges {
  double here = 0;
  double nearby = 0;                                // the best that a shift of up to 7 voxels an axis reaches
  Eigen::Vector3i shift = Eigen::Vector3i::Zero();  // voxels: of the labels, to get there
  double shift_mm = 0, voxel_mm = 0;                // the latter as Grid::MeanSpacingMm has it
  double elsewhere = 0;                             // mean of the 26 shifts by 6 voxels along some axes

  bool moved() const;           // by two voxels or more, in mm too: another place fits much better
  bool follow_nothing() const;  // fits no better than other places: another scan's map, or a mirrored one
};

// Nothing where fewer than a hundred border voxels lie far enough inside the grid. Climbs from one shift to
// the best of its neighbours; deterministic.
std::optional<BorderEdges> EdgesOfBorders(const Volume& scan, const LabelMap& labels);

}  // namespace kvx
