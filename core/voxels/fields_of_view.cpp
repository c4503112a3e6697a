// Separating planes along the axes of either grid (Gottschalk, Lin, Manocha 1996, without those of two
// edges).
#include "core/voxels/fields_of_view.h"

#include "core/voxels/to_corner.h"

namespace kvx {
namespace {

// `grid` sees nothing of `other`: all of its corners lie beyond one side.
bool LiesBeyondASide(const Grid& grid, const Grid& other) {
  Eigen::AlignedBox3d corners;  // voxels of `grid`
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Array3d at = ToCorner(corner).cast<double>();
    const PointVox p{(at * other.size.array().cast<double>() - 0.5).matrix()};
    corners.extend(grid.ToVox(other.ToMm(p)).ijk);
  }
  return (corners.max().array() <= -0.5).any() ||
         (corners.min().array() >= grid.size.array().cast<double>() - 0.5).any();
}

}  // namespace

bool FieldsOfViewApart(const Grid& a, const Grid& b) {
  return LiesBeyondASide(a, b) || LiesBeyondASide(b, a);
}

}  // namespace kvx
