// Label maps of which each bone had a layer of its own.
#pragma once
#include <cstddef>
#include <map>

#include "core/image.h"

namespace kvx {

struct LayeredLabels {
  LabelMap labels;
  // Per label, the voxels of its layer that are not its own: an earlier layer holds them too. None: absent.
  std::map<int, size_t> shared_voxels;
};

}  // namespace kvx
