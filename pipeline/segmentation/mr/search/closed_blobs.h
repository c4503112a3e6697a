// Bright blobs with a wall around them: heads of bones, carpal bones, also what fat lies between tendons.
#pragma once
#include <vector>

#include "core/image.h"

namespace kvx {

struct ClosedBlob {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  // of the voxels' centres from the grid's first
  double radius_mm = 0;                                 // into the wall, the median of all ways
  double closed = 0;  // part of the ways out that come to a wall, at about the same distance
  double aside = 0;   // how far the walls' middle lies from the centre, in radii
};

// Whether it is so much darker somewhere between two places than at either that a wall parts them. In mm from
// the centre of the grid's first voxel.
bool IsWalled(const Volume& relative, const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm);

// Those about a place of the mask, of a radius of at most `most_mm`, the best closed ones first; none lies
// for the most part in a better one. `relative`: 1 is marrow; the mask lies on its grid.
std::vector<ClosedBlob> FindClosedBlobs(const Volume& relative, const Mask& where, double most_mm);

}  // namespace kvx
