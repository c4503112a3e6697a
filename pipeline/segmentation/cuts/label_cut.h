// Several labels at once: which of them each voxel has, so that costs per voxel and seams between labels are
// cheapest together.
#pragma once
#include <functional>

#include "core/image.h"

namespace kvx {

struct LabelCosts {
  // Nats of a label in a voxel; infinite where it cannot be.
  std::function<float(uint16_t label, size_t voxel)> nats;
  // Nats per face of a seam are the product of both voxels' roots.
  const Image<float>& seam_root;
};

// Expansion moves (Boykov, Veksler and Zabih 2001): label by label, all voxels that do better take it at
// once. `labels`: a possible state to begin with; 0 takes no part.
LabelMap CheapestLabels(LabelMap labels, const LabelCosts& costs);

}  // namespace kvx
