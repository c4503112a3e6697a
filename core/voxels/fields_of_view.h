// Whether two volumes can show the same thing at all.
#pragma once
#include "core/grid.h"

namespace kvx {

// True only if no voxel of one lies in a voxel of the other. Boxes that stand askew, corner by edge, may be
// apart and not be found to be.
bool FieldsOfViewApart(const Grid& a, const Grid& b);

}  // namespace kvx
