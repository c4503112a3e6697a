// From every face of a piece's surface the steepest way down is followed, so that air behind a thin bone does
// not count for its other side.
#include "pipeline/segmentation/ct/pieces_in_air.h"

#include <vector>

#include "core/voxels/components.h"
#include "core/voxels/neighbours.h"
#include "pipeline/scans/grey_kind.h"
#include "pipeline/segmentation/ct/neck_parts.h"

namespace kvx {
namespace {

constexpr double kEdgeMm = 4;           // over which the edge of what lies in air is blurred
constexpr double kMostOfSurface = 0.6;  // tables and casts have 0.7 to 1, ribs up to 0.3
constexpr double kLeastMm3 = 5000;      // a child's finger has little flesh, too, but its bones are smaller

// The voxel beside `v` to which the density falls most over the way there, and that way; `v` where it rises.
struct WayDown {
  size_t to;
  double mm;
};

WayDown SteepestFrom(const Volume& scan_hu, size_t v) {
  const Grid& grid = scan_hu.grid;
  WayDown steepest{v, 0};
  double most = 0;  // HU per mm
  ForEachNeighbour(grid, v, [&](size_t beside) {
    const double mm = (grid.Ijk(beside) - grid.Ijk(v)).cast<double>().cwiseProduct(grid.spacing_mm).norm();
    const double fall = double(scan_hu.values[v] - scan_hu.values[beside]) / mm;
    if (fall > most) most = fall, steepest = {beside, mm};
  });
  return steepest;
}

bool FallsToAir(const Volume& scan_hu, size_t v, double within_mm) {
  while (scan_hu.values[v] >= kCtAirHu) {
    const WayDown down = SteepestFrom(scan_hu, v);
    within_mm -= down.mm;
    if (down.to == v || within_mm < 0) return false;
    v = down.to;
  }
  return true;
}

// Per piece.
std::vector<uint8_t> LieInAir(const Volume& scan_hu, const Components& pieces) {
  std::vector<size_t> faces(pieces.voxels.size(), 0), in_air(pieces.voxels.size(), 0);
  const Grid& grid = scan_hu.grid;
  for (size_t v = 0; v < scan_hu.values.size(); ++v) {
    const int32_t piece = pieces.piece.values[v];
    if (piece < 0) continue;
    for (int side = 0; side < 6; ++side) {
      const Eigen::Vector3i beside = grid.Ijk(v) + StepToSide(side);
      if (!grid.Contains(beside)) continue;
      const size_t outside = grid.Index(beside.x(), beside.y(), beside.z());
      if (pieces.piece.values[outside] >= 0) continue;
      ++faces[size_t(piece)];
      in_air[size_t(piece)] += FallsToAir(scan_hu, outside, kEdgeMm - grid.spacing_mm[side / 2]);
    }
  }
  std::vector<uint8_t> lie_in_air;
  for (size_t p = 0; p < faces.size(); ++p)
    lie_in_air.push_back(double(in_air[p]) > kMostOfSurface * double(faces[p]));
  return lie_in_air;
}

}  // namespace

DenseInAir DropPiecesInAir(const Volume& scan_hu, Mask& dense) {
  const Components pieces = LabelComponents(dense);
  std::vector<uint8_t> in_air = LieInAir(scan_hu, pieces);
  int lying = 0, others = 0;
  for (size_t p = 0; p < in_air.size(); ++p) {
    const double mm3 = double(pieces.voxels[p]) * dense.grid.spacing_mm.prod();
    in_air[p] = in_air[p] && mm3 >= kLeastMm3;
    lying += in_air[p];
    others += !in_air[p] && mm3 >= kLeastBoneMm3;
  }
  if (others == 0) return {0, lying > 0};
  for (size_t v = 0; v < dense.values.size(); ++v)
    if (dense.values[v] && in_air[size_t(pieces.piece.values[v])]) dense.values[v] = 0;
  return {lying, false};
}

}  // namespace kvx
