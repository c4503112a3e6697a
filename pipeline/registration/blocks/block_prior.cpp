// Per cell of 2 x 2 x 2 voxels.
#include "pipeline/registration/blocks/block_prior.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/host/parallel.h"

namespace kvx {
namespace {

// Bending of the field in air, relative to tissue: enough to keep it smooth
constexpr double kAirStiffness = 0.05;
// Prior spread of a block's displacement, in block widths, where the start is a voxel off
constexpr double kStrain = 0.022;
constexpr double kLeastStrain = 0.002, kMostStrain = 0.04;

// The least freedom of the cells that a cell's laplacian looks at.
float LeastMobility(const Grid& cells, const std::vector<float>& mobility, const Eigen::Vector3i& cell) {
  float least = 1;
  for (int n = 0; n < 7; ++n) {
    Eigen::Vector3i p = cell;
    if (n < 6) p[n / 2] += n % 2 ? 1 : -1;
    if (cells.Contains(p)) least = std::min(least, mobility[cells.Index(p.x(), p.y(), p.z())]);
  }
  return least;
}

// Beside bones the mask bends the field within a voxel or two; that is meant, and not charged as bending.
float Stiffness(float least_mobility, bool in_air) {
  return (in_air ? float(kAirStiffness) : 1.0f) * least_mobility * least_mobility;
}

// Prior: a block's displacement has spread strain * width, so that 1/2 F^T G^-1 F G(c,c) / spread^2 = 1/2
// bending * integral.
double BendingStrength(const Grid& grid) {
  const double spacing = grid.MeanSpacingMm(), spread = kStrain * kBlockVoxels * spacing;
  return 0.5 * kSupportVoxels * spacing * BlockSpline().SelfEnergy() / (16 * kPi * spread * spread);
}

}  // namespace

// The residual is itself a rough estimate, so it counts half (in logarithms) beside what is usual: the spread
// of the prior goes with its square root.
Firmness MeasureFirmness(const BlockLevel& start, std::vector<float> residual_voxels) {
  constexpr float kLeast = float((kStrain * kStrain) / (kMostStrain * kMostStrain));
  constexpr float kMost = float((kStrain * kStrain) / (kLeastStrain * kLeastStrain));
  Firmness out{start.grid, start.template_voxels, std::move(residual_voxels)};
  for (float& value : out.values)
    value = std::clamp(1 / std::max(1e-6f, start.template_voxels * value), kLeast, kMost);
  return out;
}

Firmness GeometricMean(const Firmness& earlier, const Firmness& later) {
  Firmness out = later;
  if (earlier.values.size() != later.values.size()) return out;
  for (size_t c = 0; c < out.values.size(); ++c)
    out.values[c] = std::sqrt(earlier.values[c] * later.values[c]);
  return out;
}

void ApplyPrior(const Firmness& firmness, const Volume& body_distance_mm, double reach_mm,
                BlockLevel& level) {
  level.bending = BendingStrength(level.grid);
  const Grid cells = Coarsened(level.grid, 2), given = Coarsened(firmness.grid, 2);
  const std::vector<float> mobility = CellMeans(level.grid, level.mobility);
  ParallelEach(level.stiffness.size(), [&](size_t c) {
    const Eigen::Vector3i cell = cells.Ijk(c), finest = 2 * level.template_voxels * cell;
    const Eigen::Vector3i p = finest / (2 * firmness.template_voxels);
    const Eigen::Vector3i middle = finest.array() + level.template_voxels - 1;  // or the voxel beyond it
    const bool in_air = body_distance_mm(middle.x(), middle.y(), middle.z()) > reach_mm;
    level.firmness[c] = firmness.values[given.Index(p.x(), p.y(), p.z())];
    level.stiffness[c] = level.firmness[c] * Stiffness(LeastMobility(cells, mobility, cell), in_air);
  });
}

}  // namespace kvx
