// The body mask: half way between air and the tissue around a voxel, so that a bias field does not move the
// skin.
#include "pipeline/skinning/segment_body.h"

#include "core/components.h"
#include "core/gaussian_blur.h"
#include "core/parallel.h"
#include "pipeline/scans/air_level.h"
#include "pipeline/scans/filled_corners.h"
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

template <class T>
T Beside(const Image<T>& image, Eigen::Vector3i p, int axis, int step) {
  p[axis] = std::clamp(p[axis] + step, 0, image.grid.size[axis] - 1);
  return image(p.x(), p.y(), p.z());
}

// Half the weight stays at the centre: a gap one voxel wide between fingers stays darker than half the
// tissue.
Volume LightlySmoothed(const Volume& volume) {
  Volume out(volume.grid);
  ParallelEach(out.values.size(), [&](size_t v) {
    const Eigen::Vector3i p = volume.grid.Ijk(v);
    float sum = 6.0f * volume.values[v];
    for (int axis = 0; axis < 3; ++axis) sum += Beside(volume, p, axis, -1) + Beside(volume, p, axis, 1);
    out.values[v] = sum / 12.0f;
  });
  return out;
}

// How much brighter than air the tissue around each cell is: a normalised blur over the mask.
Volume TissueAboveAir(const Volume& smooth, const Mask& mask, const AirLevel& level) {
  const Grid cells = Coarsened(smooth.grid, kCell);
  Volume sum(cells), count(cells);
  for (size_t v = 0; v < mask.values.size(); ++v) {
    if (!mask.values[v]) continue;
    const Eigen::Vector3i c = smooth.grid.Ijk(v) / kCell;
    sum(c.x(), c.y(), c.z()) += float(smooth.values[v] - level.air);
    count(c.x(), c.y(), c.z()) += 1.0f;
  }
  BinomialBlur(sum, kBlurs), BinomialBlur(count, kBlurs);
  for (size_t c = 0; c < sum.values.size(); ++c) {
    sum.values[c] =
        float((sum.values[c] + kPriorVoxels * (level.tissue - level.air)) / (count.values[c] + kPriorVoxels));
  }
  return sum;
}

Mask AboveSkinLevel(const Volume& smooth, const Volume& tissue_above_air, const AirLevel& level) {
  Mask mask(smooth.grid);
  const Eigen::Vector3d top = (tissue_above_air.grid.size.array() - 1).cast<double>();
  ParallelEach(mask.values.size(), [&](size_t v) {
    const Eigen::Vector3d centre = smooth.grid.Ijk(v).cast<double>().array() - 0.5 * (kCell - 1);
    const PointVox in_cells{(centre / kCell).cwiseMax(0.0).cwiseMin(top)};
    const double rise =
        std::max(kSkinLevel * SampleTrilinear(tissue_above_air, in_cells), kNoiseSpreads * level.spread);
    mask.values[v] = smooth.values[v] - level.air > rise;
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
  const Volume smooth = LightlySmoothed(WithAirInCorners(scan.volume, scan.modality));
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
  return WithoutOtherLimbs(FillHoles(IsMagnitude(scan.volume) ? WithDimTissue(smooth, bright, *level)
                                                              : WithoutSurroundings(bright, *inputs.bones)),
                           *inputs.bones);
}

}  // namespace kvx
