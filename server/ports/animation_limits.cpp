// Said in numbers that docs/api.md says too.
#include "server/ports/animation_limits.h"

#include <cmath>

#include "core/errors.h"
#include "pipeline/io/voxel_values.h"

namespace kvx {

void RequireFewFrames(int frames) {
  constexpr int kMost = 2000;
  if (frames > kMost) throw InputError("the animation has more than 2000 frames; use a smaller fps");
}

void RequireFewBytes(const Grid& grid, int level, ScalarType type, int frames) {
  constexpr double kMost = 4e9;
  const double voxels = double(grid.VoxelCount()) / std::pow(8.0, level);
  if (voxels * double(BytesOf(VoxelTypeOf(type))) * frames > kMost)
    throw InputError("the animation would be larger than 4 GB; use a higher level or a smaller fps");
}

}  // namespace kvx
