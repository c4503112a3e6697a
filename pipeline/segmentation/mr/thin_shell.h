// Bones whose cortex is hardly thicker than the blur of a scan: their surfaces between the voxels.
#pragma once
#include <vector>

#include "core/image.h"

namespace kvx {

struct RoughBone {
  Volume relative;  // intensities to the marrow's level
  Mask mask;        // the bone about, on the same grid
  Mask marrow;      // what is bright in it
};

struct ThinShell {
  Mask mask;                    // with the shell
  double thickness_voxels = 0;  // of the shell
  bool resolved = true;         // it is thick enough to be seen by itself, and the mask is as it was
};

// Of bones of one scan, so with one blur. What is too far from the marrow for a thin shell (tendons look like
// cortex) is taken off; then the surface of each is moved by up to a voxel or so, to where
// marrow, a shell of one thickness and other tissue explain the scan best. An empty mask stays empty.
std::vector<ThinShell> FitThinShells(const std::vector<RoughBone>& bones);

}  // namespace kvx
