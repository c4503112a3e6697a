// The finest level from the study's images, and each coarser one by pooling.
#include "pipeline/registration/blocks/level_builder.h"

#include <algorithm>
#include <cmath>

#include "core/host/parallel.h"
#include "pipeline/registration/images/start_residual.h"

namespace kvx {
namespace {

constexpr int kMaxLevels = 4;  // blocks of 8 to 64 voxels of the template

// Residual that a level can take up: coarser levels are left out when a finer one can
constexpr double kReachVoxels = 1.5;
// Of a level's voxels around the body: both sides of the skin's edge count
constexpr double kRingVoxels = 1.5;
// Sampling and partial volume: what remains of an edge where registration is right, and where it only has to
// be near
constexpr double kEdgeErrorVoxels = 0.25, kFarEdgeErrorVoxels = 0.5;
constexpr double kActiveVoxels = 8;  // of a level, around the body, where the field is worked on

// Turns level.weight from the share of usable voxels into inverse variances. A coarse voxel is the mean of
// many fine ones, so its noise variance is that of one over their number; the edge error scales with the
// slope per voxel. Far off, tissue within a voxel moves in more ways than one: nothing averages out.
void WeightByVariance(bool far, BlockLevel& level) {
  const double pooled = far ? 1 : std::pow(level.template_voxels, 3);
  const double edge_voxels = far ? kFarEdgeErrorVoxels : kEdgeErrorVoxels;
  ParallelEach(level.grid.VoxelCount(), [&](size_t v) {
    if (level.weight[v] <= 0) return;
    const double edge = edge_voxels * edge_voxels * SlopeSquared(level, v);
    level.weight[v] = float(level.weight[v] / (level.voxels_a_measurement * (1.0 / pooled + edge)));
  });
}

bool NearCounting(const BlockLevel& level, const Eigen::Vector3i& cell) {
  for (int n = 0; n < 64; ++n) {
    const Eigen::Vector3i p = 2 * cell + Eigen::Vector3i(n & 3, n >> 2 & 3, n >> 4) - Eigen::Vector3i::Ones();
    if (level.grid.Contains(p) && level.weight[level.grid.Index(p.x(), p.y(), p.z())] > 0) return true;
  }
  return false;
}

void FillActive(const Volume& body_distance_mm, BlockLevel& level) {
  const double reach_mm = kActiveVoxels * level.grid.spacing_mm.maxCoeff();
  const Grid cells = Coarsened(level.grid, 2);
  enum Kind : uint8_t { kIdle, kActive, kVisible };
  std::vector<Kind> kinds(level.stiffness.size(), kIdle);
  ParallelEach(kinds.size(), [&](size_t c) {
    const Eigen::Vector3i cell = cells.Ijk(c), p = 2 * level.template_voxels * cell;
    if (body_distance_mm(p.x(), p.y(), p.z()) > reach_mm) return;
    kinds[c] = NearCounting(level, cell) ? kVisible : kActive;
  });
  for (size_t c = 0; c < kinds.size(); ++c) {
    if (kinds[c] != kIdle) level.active.push_back(cl_int(c));
    if (kinds[c] == kVisible) level.visible.push_back(cl_int(c));
  }
}

// How much of every voxel counts: voxels of the finest level within the ring of this level's width, or as far
// as the finest counts any.
void CountRing(const Volume& body_distance_mm, const std::vector<float>& finest_counts, BlockLevel& level) {
  const int step = level.template_voxels;
  const Grid& finest = body_distance_mm.grid;
  const double reach_mm = kRingVoxels * step * finest.spacing_mm.maxCoeff();
  ParallelEach(level.weight.size(), [&](size_t v) {
    if (level.weight[v] <= 0) return;
    const Eigen::Vector3i first = step * level.grid.Ijk(v);
    int count = 0;
    for (int c = 0; c < step * step * step; ++c) {
      const Eigen::Vector3i p = first + Eigen::Vector3i(c % step, c / step % step, c / (step * step));
      const size_t at = finest.Index(p.x(), p.y(), p.z());
      count += finest_counts[at] > 0 && body_distance_mm.values[at] <= reach_mm;
    }
    level.weight[v] = float(count) / float(step * step * step);
  });
}

// Means over the 2 x 2 x 2 voxels that count; mobility takes the least of them.
BlockLevel Halved(const BlockLevel& fine) {
  BlockLevel out = EmptyLevel(Coarsened(fine.grid, 2));
  out.template_voxels = 2 * fine.template_voxels;
  out.voxels_a_measurement = fine.voxels_a_measurement;
  ParallelEach(out.grid.VoxelCount(), [&](size_t v) {
    const Eigen::Vector3i p = 2 * out.grid.Ijk(v);
    float known = 0, intensity = 0, mobility = 1;
    for (int c = 0; c < 8; ++c) {
      const size_t u = fine.grid.Index(p.x() + (c & 1), p.y() + ((c >> 1) & 1), p.z() + (c >> 2));
      intensity += fine.intensity[u];
      mobility = std::min(mobility, fine.mobility[u]);
      out.start[v] += fine.start[u] / 8;
      known += fine.weight[u] > 0 ? 1.0f : 0.0f;
    }
    // Scan voxels of the coarser scan: (p - 0.5) / 2.
    out.start[v].head<3>() = 0.5f * (out.start[v].head<3>().array() - 0.5f);
    out.intensity[v] = intensity / 8;
    out.mobility[v] = mobility;
    out.weight[v] = known / 8;
  });
  return out;
}

bool CanHalve(const BlockLevel& level) {
  return level.grid.size.minCoeff() >= kSupportVoxels && level.scan.grid.size.minCoeff() >= 8;
}

}  // namespace

WorkRegion RegionOfLevels(const Mask& body) {
  const WorkRegion all = RegionAround(body, 2 << (kMaxLevels - 1));
  // The coarsest is made where the one before has room for a block's support; others are even without.
  constexpr int kWithAll = kSupportVoxels << (kMaxLevels - 2);
  return all.grid.size.minCoeff() >= kWithAll ? all : RegionAround(body, 1 << (kMaxLevels - 1));
}

LevelBuilder::LevelBuilder(const RegistrationInputs& inputs, const Eigen::Vector3i& times,
                           const Volume& beyond_coat_mm, const WorkRegion& region, Backend& backend)
    : inputs_(inputs),
      region_(region),
      pyramid_(backend),
      images_(PrepareImages(inputs, times, beyond_coat_mm, region, pyramid_)) {}

std::vector<BlockLevel> LevelBuilder::Build(std::span<const Eigen::Vector3f> start_mm) {
  std::vector<BlockLevel> levels;
  levels.push_back(FinestLevel(inputs_, images_, start_mm, region_));
  while (int(levels.size()) < kMaxLevels && CanHalve(levels.back())) {
    BlockLevel coarse = Halved(levels.back());
    coarse.scan = pyramid_.Halved(levels.back().scan);
    levels.push_back(std::move(coarse));
  }
  const std::vector<float> finest_counts = levels[0].weight;
  for (size_t l = 0; l < levels.size(); ++l) {
    CountRing(images_.body_distance_mm, finest_counts, levels[l]);
    WeightByVariance(l >= kNearLevels, levels[l]);
  }
  size_t start = 0;  // the finest level within whose reach the residual is
  StartResidual residual(levels[0]);
  while (start + 1 < levels.size() && residual.Voxels() > kReachVoxels)
    residual = StartResidual(levels[++start]);
  levels.resize(start + 1);
  const Firmness measured = MeasureFirmness(levels.back(), residual.LocalVoxels());
  firmness_ = firmness_ ? GeometricMean(*firmness_, measured) : measured;
  for (BlockLevel& level : levels) {
    const double ring_mm = kRingVoxels * level.grid.spacing_mm.maxCoeff();
    ApplyPrior(*firmness_, images_.body_distance_mm, ring_mm, level);
    FillActive(images_.body_distance_mm, level);
  }
  return levels;
}

}  // namespace kvx
