// Closed, smooth surfaces of sets of voxels: bones by their labels, skin by the body's mask.
#pragma once
#include "core/image.h"
#include "core/triangle_mesh.h"

namespace kvx {

struct SurfaceOptions {
  double smoothing_vox = 1.0;      // standard deviation of the Gaussian on the distance to the surface
  double largest_error_vox = 0.1;  // of the simplified mesh (simplified_mesh.h); 0: every triangle stays
};

// The signed distance to the set's border, smoothed, cut where the surface encloses the volume of the set's
// voxels, simplified. A set that reaches the grid's edge is closed there. Empty for an empty set.
TriangleMesh MaskSurface(const Mask& set, const SurfaceOptions& options = {});

}  // namespace kvx
