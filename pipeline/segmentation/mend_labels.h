// A finished label map without what brushes and other tools leave behind: specks, and bones without marrow. A
// few stray voxels are enough to make a bone's box as long as the hand.
#pragma once
#include <map>
#include <vector>

#include "core/image.h"

namespace kvx {

using VoxelsByLabel = std::map<int, std::vector<size_t>>;

// Pieces (26-neighbours) that are far smaller than their label is: under a hundredth of it, of small labels
// under four voxels. None of a label most of which would go.
VoxelsByLabel StrayVoxels(const LabelMap& labels);

// Voxels of no label that one label encloses on all sides, the view's border being none of them.
VoxelsByLabel EnclosedVoxels(const LabelMap& labels);
// Gives them to their label, and returns them.
VoxelsByLabel FillEnclosed(LabelMap& labels);

struct MendedLabels {
  LabelMap labels;
  VoxelsByLabel strays, filled;  // taken from their label, then given to it
};
MendedLabels MendLabels(LabelMap labels);

}  // namespace kvx
