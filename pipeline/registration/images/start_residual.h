// How far a start is off, from the images alone, before anything is registered.
#pragma once
#include <optional>

#include "kernels/block_level.h"

namespace kvx {

// Whether the start puts the voxel inside the scan.
bool LandsInside(const BlockLevel& level, const Grid& scan, size_t voxel);

// What the scan shows where the start puts the voxel; nothing outside the scan.
std::optional<double> Landed(const BlockLevel& level, const Volume& scan, size_t voxel);

// Of the template's intensities, per voxel, by central differences.
double SlopeSquared(const BlockLevel& level, size_t voxel);

// The displacement along the slopes that would explain the intensity differences beyond noise, in voxels of
// the level. Too small where it exceeds the width of an edge, so compare it with about one voxel.
class StartResidual {
 public:
  explicit StartResidual(const BlockLevel& level);
  double Voxels() const;
  // The same around every cell of the level (as wide as a block's support), pulled towards that of the whole
  // level where there is little to see.
  std::vector<float> LocalVoxels() const;

  struct Sums {
    double squares = 0, slopes = 0;
    double Voxels() const;
    Sums& operator+=(const Sums& other);
  };

 private:
  Grid cells_, blocks_;  // blocks of 8 voxels, side by side
  std::vector<Sums> sums_;
};

}  // namespace kvx
