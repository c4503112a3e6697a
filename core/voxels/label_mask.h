// One label of a label map as a mask.
#pragma once
#include <algorithm>

#include "core/image.h"

namespace kvx {

// 1 where the map has `label`, on the map's grid.
inline Mask MaskOfLabel(const LabelMap& labels, int label) {
  Mask mask(labels.grid);
  std::ranges::transform(labels.values, mask.values.begin(),
                         [label](uint16_t value) { return uint8_t(value == label); });
  return mask;
}

}  // namespace kvx
