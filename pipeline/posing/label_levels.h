// Where bones end between the voxels of their labels.
#pragma once
#include <vector>

#include "core/image.h"

namespace kvx {

// For every label up to the greatest: at which share of it, trilinear between voxels, it ends so that it has
// its voxels' volume. Half where borders are flat; less of what is round, for half the share takes from what
// juts out, a tenth of small bones. Half as well of 0, and of labels that no voxel has.
std::vector<float> LabelLevels(const LabelMap& labels);

}  // namespace kvx
