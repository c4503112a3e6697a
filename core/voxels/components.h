// Connected pieces of a mask (6-neighbours) and holes in it.
#pragma once
#include "core/image.h"

namespace kvx {

struct Components {
  Image<int32_t> piece;        // number of a voxel's piece, -1 outside the mask
  std::vector<size_t> voxels;  // per piece
};

Components LabelComponents(const Mask& mask);

// Per piece, 1 or 0: those that hold one of these voxels.
std::vector<uint8_t> PiecesWith(const Components& pieces, const Mask& some);

// The voxels of the chosen pieces.
Mask MaskOf(const Components& pieces, const std::vector<uint8_t>& chosen);

// What the mask leaves out.
Mask Complement(const Mask& mask);

// Without the pieces smaller than `fraction` of the largest one.
Mask KeepLargePieces(const Mask& mask, double fraction);

// The pieces that touch the border of the grid. Along an axis of one voxel there is none: the mask is a
// slice.
Mask PiecesAtBorder(const Mask& mask);

// With every hole filled that the mask encloses in 3-D. Where the body is cut by the border of the volume, a
// hole of the border slice (a bone or vessel cut across) is closed there first. An air gap that is open
// anywhere stays open.
Mask FillHoles(const Mask& mask);

}  // namespace kvx
