// Artefacts come from disks and from other people: sizes are not believed.
#include "pipeline/artifacts/core_fields.h"

namespace kvx {

void RequireVoxels(const Grid& grid, size_t count) {
  size_t rest = count;
  for (const int size : grid.size) {
    if (size < 0 || (size > 0 && rest % size_t(size) != 0)) throw Unavailable("a stored artefact is damaged");
    rest = size > 0 ? rest / size_t(size) : 0;
  }
  if (grid.size.minCoeff() > 0 ? rest != 1 : count != 0) throw Unavailable("a stored artefact is damaged");
}

}  // namespace kvx
