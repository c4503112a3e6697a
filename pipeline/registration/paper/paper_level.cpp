// Pooling of volumes and masks, and D between resolutions.
#include "pipeline/registration/paper/paper_level.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "core/voxels/sample_clamped.h"
#include "core/voxels/to_corner.h"
#include "kernels/pyramid.h"

namespace kvx {
namespace {

constexpr int kFirstNumber = 3, kLastNumber = 5;  // blocks of 32 and of 8 voxels (paper, section 6.1)
constexpr int kLeastVoxels = 8;                   // of a level along its shortest axis

// A coarse voxel is in the mask where at least half of its fine ones are.
Mask Halved(const Mask& fine) {
  Mask coarse(Coarsened(fine.grid, 2));
  for (size_t v = 0; v < coarse.values.size(); ++v) {
    const Eigen::Vector3i first = 2 * coarse.grid.Ijk(v);
    int there = 0, set = 0;
    for (int c = 0; c < 8; ++c) {
      const Eigen::Vector3i p = first + ToCorner(c);
      if (!fine.grid.Contains(p)) continue;
      ++there;
      set += fine(p.x(), p.y(), p.z()) != 0;
    }
    coarse.values[v] = 2 * set >= there;
  }
  return coarse;
}

}  // namespace

std::vector<PaperLevel> MakePaperLevels(const PaperPair& pair, Backend& backend) {
  const Pyramid pyramid(backend);
  std::vector<PaperLevel> levels{{kLastNumber, 1, pair.source, pair.target, pair.counts, pair.bone}};
  while (levels.back().number > kFirstNumber &&
         levels.back().source.grid.size.minCoeff() >= 2 * kLeastVoxels) {
    const PaperLevel& fine = levels.back();
    levels.push_back({fine.number - 1, 2 * fine.template_voxels, pyramid.Halved(fine.source),
                      pyramid.Halved(fine.target), Halved(fine.counts), Halved(fine.bone)});
  }
  std::ranges::reverse(levels);
  return levels;
}

VoxelShifts RefinedShifts(const VoxelShifts& coarse, const Grid& fine) {
  VoxelShifts out(fine);
  ParallelEach(out.values.size(), [&](size_t v) {
    const PointVox p{(fine.Ijk(v).cast<double>() - Eigen::Vector3d::Constant(0.5)) / 2};
    out.values[v] = (2 * SampleTrilinear(coarse, p)).cast<float>();
  });
  return out;
}

float DeformedSourceAt(const PaperLevel& level, const VoxelShifts& shifts, size_t voxel) {
  const Eigen::Vector3d at =
      level.source.grid.Ijk(voxel).cast<double>() + shifts.values[voxel].cast<double>();
  return SampleClamped(level.source, PointVox{at});
}

Volume DeformedSource(const PaperLevel& level, const VoxelShifts& shifts) {
  Volume out(level.source.grid);
  ParallelEach(out.values.size(), [&](size_t v) { out.values[v] = DeformedSourceAt(level, shifts, v); });
  return out;
}

}  // namespace kvx
