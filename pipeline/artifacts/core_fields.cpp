// Artefacts come from disks and from other people: sizes are not believed.
#include "pipeline/artifacts/core_fields.h"

namespace kvx {

void RequireVoxels(const Grid& grid, size_t count) {
  const Eigen::Array3d size = grid.size.cast<double>().array();
  if ((size < 0).any() || size.prod() != double(count)) throw Unavailable("a stored artefact is damaged");
}

}  // namespace kvx
