// A ball is rolled in from the air.
#include "pipeline/segmentation/ct/ct_outside.h"

#include <algorithm>

#include "core/voxels/components.h"
#include "core/voxels/distance_transform.h"
#include "pipeline/segmentation/ct/pieces_in_air.h"

namespace kvx {
namespace {

constexpr float kDenseHu = 140;   // denser than soft tissue; a thin shell in thick slices is hardly more
constexpr double kBallMm = 8;     // does not get through the gaps of a shell
constexpr double kSpeckMm3 = 50;  // noise and small calcifications are no shell

Mask Dense(const Volume& scan_hu) {
  Mask dense(scan_hu.grid);
  for (size_t v = 0; v < dense.values.size(); ++v) dense.values[v] = scan_hu.values[v] > kDenseHu;
  const Components pieces = LabelComponents(dense);
  const double voxel_mm3 = scan_hu.grid.spacing_mm.prod();
  for (size_t v = 0; v < dense.values.size(); ++v) {
    if (dense.values[v] && double(pieces.voxels[size_t(pieces.piece.values[v])]) * voxel_mm3 < kSpeckMm3)
      dense.values[v] = 0;
  }
  DropPiecesInAir(scan_hu, dense);  // within a cast no ball would reach the limb
  return dense;
}

}  // namespace

Mask OutsideOfBones(const Volume& scan_hu) {
  const Volume distance_mm = DistanceMapMm(Dense(scan_hu));
  const double ball_mm = std::max(kBallMm, 1.5 * scan_hu.grid.spacing_mm.maxCoeff());
  Mask outside(scan_hu.grid);
  for (size_t v = 0; v < outside.values.size(); ++v) outside.values[v] = distance_mm.values[v] > ball_mm;
  const Components pieces = LabelComponents(outside);
  Mask air(scan_hu.grid);
  for (size_t v = 0; v < air.values.size(); ++v) air.values[v] = scan_hu.values[v] < kThinnestHu;
  return MaskOf(pieces, PiecesWith(pieces, air));
}

}  // namespace kvx
