// Host loops over the cells.
#include "pipeline/registration/images/disagreement.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "core/voxels/gaussian_blur.h"
#include "core/voxels/neighbours.h"
#include "pipeline/registration/images/shown_voxels.h"
#include "pipeline/registration/images/usual_residual.h"

namespace kvx {
namespace {

constexpr double kAboutCells = 2;  // standard deviation of what counts as about a cell
constexpr float kFewest = 1e-3f;   // voxels, of the mean about a cell

CellDisagreement OfCell(const BlockLevel& level, std::span<const Eigen::Vector3f> scan_mm,
                        const Eigen::Vector3i& first) {
  CellDisagreement out;
  ForEachShown(level, scan_mm, first, [&](size_t v, const PointVox& p) {
    const float difference = float(SampleTrilinear(level.scan, p)) - level.intensity[v];
    out.squares += level.weight[v] * difference * difference;
    out.count += 1;
  });
  out.squares *= float(level.voxels_a_measurement);
  return out;
}

}  // namespace

std::vector<CellDisagreement> DisagreementOfCells(const BlockLevel& level,
                                                  std::span<const Eigen::Vector3f> scan_mm) {
  const Grid cells = Coarsened(level.grid, 2);
  std::vector<CellDisagreement> out(cells.VoxelCount());
  ParallelEach(out.size(), [&](size_t c) { out[c] = OfCell(level, scan_mm, 2 * cells.Ijk(c)); });
  return out;
}

std::vector<float> DisagreementBeside(const BlockLevel& level, std::span<const Eigen::Vector3f> scan_mm) {
  const Grid grid = Coarsened(level.grid, 2);
  const std::vector<CellDisagreement> cells = DisagreementOfCells(level, scan_mm);
  std::vector<float> out(cells.size());
  ParallelEach(out.size(), [&](size_t c) {
    CellDisagreement sum;
    ForEachAround(grid, c,
                  [&](size_t near) { sum.squares += cells[near].squares, sum.count += cells[near].count; });
    out[c] = sum.squares / std::max(1.0f, sum.count);
  });
  return out;
}

Volume DisagreementAround(const BlockLevel& level, std::span<const Eigen::Vector3f> scan_mm) {
  const std::vector<CellDisagreement> of_cells = DisagreementOfCells(level, scan_mm);
  Volume squares(Coarsened(level.grid, 2)), count(squares.grid);
  for (size_t c = 0; c < of_cells.size(); ++c)
    squares.values[c] = of_cells[c].squares, count.values[c] = of_cells[c].count;
  for (Volume* volume : {&squares, &count}) GaussianBlur(*volume, Eigen::Vector3d::Constant(kAboutCells));
  for (size_t c = 0; c < of_cells.size(); ++c)
    squares.values[c] =
        count.values[c] > kFewest ? squares.values[c] / count.values[c] / float(kUsualResidual) : 0;
  return squares;
}

}  // namespace kvx
