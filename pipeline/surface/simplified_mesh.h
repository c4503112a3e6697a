// A closed mesh with fewer triangles.
#pragma once
#include "core/triangle_mesh.h"

namespace kvx {

// Edges collapse while the surface stays within `largest_error_mm` by its quadric error (Garland & Heckbert
// 1997): a root mean square over the planes that met in a vertex, so single places lie up to twice as far
// off. Where the collapsed surface would meet itself, as in thin folds, the neighbourhood keeps its
// triangles: a closed mesh stays closed. 0 returns the mesh as it is.
TriangleMesh SimplifiedMesh(const TriangleMesh& closed, double largest_error_mm);

}  // namespace kvx
