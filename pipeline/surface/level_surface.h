// The surface where a sampled function crosses zero.
#pragma once
#include "core/image.h"
#include "core/triangle_mesh.h"

namespace kvx {

// Inside is where `values` are above 0. Each cell of eight voxels is cut into six tetrahedra and the function
// taken as linear in each, so the surface is closed wherever the outermost voxels are outside.
// Its normals point outwards.
TriangleMesh LevelSurface(const Volume& values);

}  // namespace kvx
