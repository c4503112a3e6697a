// Parts of a threshold with the borders that the density shows.
#pragma once
#include "core/host/progress.h"
#include "core/image.h"

namespace kvx {

// `parts`: labels 1, 2, ... by a threshold, parted at `parting_hu` (BoneLevels), on the grid of `scan_hu`.
// What is at least half as deep in its part as the deepest voxel stands for strokes; of a part that is a
// shell, or the mesh of spongy bone, all of it does, and marrow that it encloses. The rest is found from
// them. Bone of which more would go than borders are uncertain by stays. Labels of the result are by size,
// largest first.
LabelMap RefinedParts(const Volume& scan_hu, const LabelMap& parts, double parting_hu,
                      const Progress& progress);

}  // namespace kvx
