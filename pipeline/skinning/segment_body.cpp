// The body mask: half way between air and the tissue around a voxel, so that a bias field does not move the
// skin.
#include "pipeline/skinning/segment_body.h"

#include <algorithm>
#include <utility>

#include "core/host/parallel.h"
#include "core/voxels/components.h"
#include "core/voxels/gaussian_blur.h"
#include "core/voxels/voxel_box.h"
#include "pipeline/scans/air_level.h"
#include "pipeline/scans/extremes.h"
#include "pipeline/scans/filled_corners.h"
#include "pipeline/scans/grey_kind.h"
#include "pipeline/skinning/dark_bone.h"
#include "pipeline/skinning/dim_tissue.h"
#include "pipeline/skinning/without_surroundings.h"

namespace kvx {
namespace {

constexpr int kCell = 4;    // voxels: the tissue level is kept on cells of this edge
constexpr int kBlurs = 8;   // of (1 2 1) / 4 over cells: a Gaussian of 2 cells
constexpr int kRounds = 3;  // mask and tissue level settle in two
// Of the way from air to tissue: skin is dark, its surface voxels are part air
constexpr double kSkinLevel = 0.35;
constexpr double kDimTissue = 0.1;     // of the typical tissue: what may be tissue far from the coil
constexpr double kNoiseSpreads = 5;    // air seldom exceeds this many standard deviations
constexpr double kPriorVoxels = 0.01;  // weight of the typical tissue where there is none nearby
constexpr double kGhost = 0.4;         // of the mean rise of the largest piece: dimmer pieces are ghosts
constexpr double kSmallPiece = 0.01;   // of the largest piece: smaller ones are noise

// Half the weight stays at the centre: a gap one voxel wide between fingers stays darker than half the
// tissue.
Volume LightlySmoothed(const Volume& volume) {
  Volume out(volume.grid);
  const Eigen::Vector3i& size = volume.grid.size;
  ParallelEach(size_t(size.y()) * size_t(size.z()), [&](size_t line) {
    const int j = int(line % size_t(size.y())), k = int(line / size_t(size.y()));
    const auto beside = [&](int to_j, int to_k) {
      return &volume(0, std::clamp(to_j, 0, size.y() - 1), std::clamp(to_k, 0, size.z() - 1));
    };
    const float *own = beside(j, k), *before = beside(j - 1, k), *after = beside(j + 1, k),
                *below = beside(j, k - 1), *above = beside(j, k + 1);
    float* smooth = &out(0, j, k);
    for (int i = 0; i < size.x(); ++i) {
      const float left = own[std::max(i - 1, 0)], right = own[std::min(i + 1, size.x() - 1)];
      smooth[i] = (6.0f * own[i] + (left + right) + (before[i] + after[i]) + (below[i] + above[i])) / 12.0f;
    }
  });
  return out;
}

// How much brighter than air the tissue around each cell is: a normalised blur over the mask.
Volume TissueAboveAir(const Volume& smooth, const Mask& mask, const AirLevel& level) {
  const Grid cells = Coarsened(smooth.grid, kCell);
  Volume sum(cells), count(cells);
  ParallelEach(sum.values.size(), [&](size_t c) {
    const Eigen::Vector3i first = kCell * cells.Ijk(c);
    const Eigen::Vector3i end = (first.array() + kCell).min(mask.grid.size.array()).matrix();
    ForEachVoxel(VoxelBox{first, end}, mask.grid, [&](const auto&, size_t, size_t v) {
      if (mask.values[v]) sum.values[c] += float(smooth.values[v] - level.air), count.values[c] += 1.0f;
    });
  });
  BinomialBlur(sum, kBlurs), BinomialBlur(count, kBlurs);
  for (size_t c = 0; c < sum.values.size(); ++c) {
    sum.values[c] =
        float((sum.values[c] + kPriorVoxels * (level.tissue - level.air)) / (count.values[c] + kPriorVoxels));
  }
  return sum;
}

// Where a voxel lies between the cells along an axis: beyond the outer ones' middles, at them.
struct BetweenCells {
  BetweenCells(int voxel, int cells) {
    const double at = std::clamp((voxel - 0.5 * (kCell - 1)) / kCell, 0.0, cells - 1.0);
    low = std::min(int(at), std::max(cells - 2, 0)), high = std::min(low + 1, cells - 1);
    share = at - low;
  }
  int low = 0, high = 0;
  double share = 0;  // of the upper one
};

Mask AboveSkinLevel(const Volume& smooth, const Volume& tissue_above_air, const AirLevel& level) {
  Mask mask(smooth.grid);
  const Eigen::Vector3i &size = smooth.grid.size, &cells = tissue_above_air.grid.size;
  std::vector<BetweenCells> along_x;
  for (int i = 0; i < size.x(); ++i) along_x.emplace_back(i, cells.x());
  ParallelEach(size_t(size.y()) * size_t(size.z()), [&](size_t line) {
    const int j = int(line % size_t(size.y())), k = int(line / size_t(size.y()));
    const BetweenCells y(j, cells.y()), z(k, cells.z());
    std::vector<double> tissue;  // of cells along the line
    for (int c = 0; c < cells.x(); ++c) {
      const auto along_y = [&](int of_z) {
        return std::lerp(double(tissue_above_air(c, y.low, of_z)), double(tissue_above_air(c, y.high, of_z)),
                         y.share);
      };
      tissue.push_back(std::lerp(along_y(z.low), along_y(z.high), z.share));
    }
    for (int i = 0; i < size.x(); ++i) {
      const BetweenCells& x = along_x[size_t(i)];
      const double around =
          tissue[size_t(x.low)] + x.share * (tissue[size_t(x.high)] - tissue[size_t(x.low)]);
      const double rise = std::max(kSkinLevel * around, kNoiseSpreads * level.spread);
      mask(i, j, k) = smooth(i, j, k) - level.air > rise;
    }
  });
  return mask;
}

// Motion and flow leave dim copies of the body in the air; a finger that stands alone is as bright as the
// rest.
Mask WithoutGhosts(const Volume& smooth, const Mask& mask, const AirLevel& level) {
  const Components pieces = LabelComponents(mask);
  std::vector<double> rise(pieces.voxels.size(), 0.0);
  for (size_t v = 0; v < mask.values.size(); ++v) {
    if (mask.values[v]) rise[pieces.piece.values[v]] += smooth.values[v] - level.air;
  }
  size_t largest = 0;
  for (size_t p = 0; p < rise.size(); ++p) {
    rise[p] /= double(pieces.voxels[p]);
    if (pieces.voxels[p] > pieces.voxels[largest]) largest = p;
  }
  std::vector<uint8_t> bright;
  for (const double of_piece : rise) bright.push_back(of_piece >= kGhost * rise[largest]);
  return MaskOf(pieces, bright);
}

}  // namespace

Mask SegmentBody::Run(const Inputs& inputs, const Options&, StageContext& context) {
  const Scan& scan = *inputs.scan;
  const bool hounsfield = IsHounsfield(scan.volume, scan.modality);
  const Volume smooth =
      LightlySmoothed(WithAirInCorners(WithoutExtremes(scan.volume, hounsfield).Taken(), scan.modality));
  const std::optional<AirLevel> level = FindAirLevel(smooth, scan.modality);
  if (!level) return Mask(scan.volume.grid, 1);
  // Begins with everything that may be tissue, so that a part of the body far from the coil sets its own
  // level.
  const double dim = kDimTissue / kSkinLevel * (level->tissue - level->air);
  Volume tissue(Coarsened(scan.volume.grid, kCell), float(dim));
  for (int round = 0; round < kRounds; ++round) {
    context.progress.Report(kName, double(round) / kRounds);
    tissue = TissueAboveAir(smooth, AboveSkinLevel(smooth, tissue, *level), *level);
  }
  const Mask pieces = KeepLargePieces(AboveSkinLevel(smooth, tissue, *level), kSmallPiece);
  const Mask bright = WithoutGhosts(smooth, pieces, *level);
  // In MR, tables and casts are dark, and skin over dark tendons is a shell of its own
  Mask body =
      WithoutOtherLimbs(FillHoles(IsMagnitude(scan.volume) ? WithDimTissue(smooth, bright, *level)
                                                           : WithoutSurroundings(bright, *inputs.bones)),
                        *inputs.bones);
  return WithDarkBone(std::move(body), inputs.bones->labels);
}

}  // namespace kvx
