// Iteratively reweighted least squares (Holland and Welsch 1977), with one step of them: weights as Huber's,
// for the mean over 27 cells, which a right place does not exceed by chance.
#include "pipeline/registration/images/outliers.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "pipeline/registration/images/disagreement.h"

namespace kvx {

void CountOutliersLess(std::span<const Eigen::Vector3f> scan_mm, std::vector<BlockLevel>& levels) {
  const Grid cells = Coarsened(levels.front().grid, 2);
  const std::vector<float> disagreement = DisagreementBeside(levels.front(), scan_mm);
  for (BlockLevel& level : levels) {
    ParallelEach(level.weight.size(), [&](size_t v) {
      const Eigen::Vector3i p = cells.Nearest(Eigen::Vector3i(level.template_voxels * level.grid.Ijk(v) / 2));
      level.weight[v] /= std::max(1.0f, disagreement[cells.Index(p.x(), p.y(), p.z())]);
    });
  }
}

}  // namespace kvx
