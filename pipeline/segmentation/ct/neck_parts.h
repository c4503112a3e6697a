// What is dense, parted at necks.
#pragma once
#include "core/image.h"

namespace kvx {

constexpr double kLeastBoneMm3 = 200;  // smaller pieces are no bones of their own

struct NeckParts {
  Image<int32_t> part;          // number of a voxel's part, 0 outside the mask
  std::vector<float> depth_mm;  // per number: from its deepest voxel to the nearest outside the mask
};

// The pieces of a mask: two parts stay one where the neck between them is nearly as thick as the thinner of
// them.
NeckParts PartAtNecks(const Mask& mask);

// Whether something of this size is as deep as what is filled. Shells and the mesh of spongy bone are far
// from it (ten times as large), and their depth says nothing about necks. `depth_mm`: from its deepest voxel
// to its surface.
bool IsSolid(double mm3, double depth_mm);

}  // namespace kvx
