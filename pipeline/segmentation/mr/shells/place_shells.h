// The surfaces of bones between the voxels, by the dark shell of cortex under them, be it thinner than the
// blur of a scan or thicker.
#pragma once
#include <vector>

#include "core/image.h"

namespace kvx {

struct RoughBone {
  Volume relative;    // intensities to the marrow's level; not a number where what is seen says nothing
  Mask mask;          // the bone about, on the same grid
  Mask marrow;        // what is bright in it; what lies elsewhere does not count
  bool small = true;  // its shell is about as thick all over; a long bone's is thin at the ends alone
};

struct PlacedShell {
  Mask mask;                    // the bone, with the shell
  double thickness_voxels = 0;  // of the shell, where it is usual
  bool resolved = true;         // thick enough to be seen by itself, here or there
};

// Of bones of one scan, so with one blur. What is too far from the marrow for a shell that is not resolved
// (tendons look like cortex) is taken off, what is too near it for one that is thinner than the blur is
// added; then the surface of each is moved by up to two voxels or so, to where marrow, a shell and other
// tissue explain the scan best. An empty mask stays empty.
std::vector<PlacedShell> PlaceShells(const std::vector<RoughBone>& bones);

}  // namespace kvx
