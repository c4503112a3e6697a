// The air around the body, whatever a scan's contrast: a silhouette that two scans can be compared by.
#pragma once
#include <string>

#include "core/image.h"

namespace kvx {

// On voxels of about `voxel_mm`: 1 in dark pieces that reach the border of the view, 0 elsewhere; all 0 where
// the scan shows no air.
Volume OuterAir(const Volume& volume, const std::string& modality, double voxel_mm);

}  // namespace kvx
