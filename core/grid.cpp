// Grid arithmetic and validation.
#include "core/grid.h"

#include "core/errors.h"

namespace kvx {

bool Grid::operator==(const Grid& other) const {
  constexpr double kSameMm = 1e-6;
  return size == other.size && (spacing_mm - other.spacing_mm).cwiseAbs().maxCoeff() < kSameMm &&
         (origin.lps - other.origin.lps).cwiseAbs().maxCoeff() < kSameMm &&
         (direction - other.direction).cwiseAbs().maxCoeff() < kSameMm;
}

void Validate(const Grid& grid) {
  if ((grid.size.array() <= 0).any()) throw InputError("a volume needs at least one voxel along every axis");
  if (!grid.spacing_mm.allFinite() || (grid.spacing_mm.array() <= 0).any()) {
    throw InputError("the voxel spacing must be finite and positive");
  }
  if (!grid.origin.lps.allFinite() || !grid.direction.allFinite()) {
    throw InputError("the origin and direction of a volume must be finite");
  }
  const Eigen::Matrix3d gram = grid.direction.transpose() * grid.direction;
  if (!gram.isIdentity(1e-3)) {
    throw InputError(
        "the axes of a volume must be perpendicular unit vectors; resample it onto a rectangular grid");
  }
}

Grid Coarsened(const Grid& grid, int factor) {
  Grid out = grid;
  out.size = ((grid.size.array() + factor - 1) / factor).matrix();
  out.spacing_mm = grid.spacing_mm * factor;
  out.origin = grid.ToMm(PointVox{Eigen::Vector3d::Constant(0.5 * (factor - 1))});
  return out;
}

}  // namespace kvx
