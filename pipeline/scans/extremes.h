// Voxels that read far from nearly all others: hot pixels, metal, marks that a program left. Where sums over
// neighbourhoods decide, one of them would outweigh all tissue around it.
#pragma once
#include <span>

#include "core/host/own_or_lent.h"
#include "core/image.h"
#include "core/numbers/value_range.h"

namespace kvx {

constexpr float kLeastHu = -1024;      // the least that 12 bits hold: nothing is lighter than air
constexpr float kMostTissueHu = 1500;  // bone alone

// What greys of an image count as: those beyond `range` as its ends, metal in CT as the densest bone.
struct GreyLimits {
  ValueRange range;
  float metal = std::numeric_limits<float>::infinity();
  float operator()(float grey) const {
    return std::clamp(grey >= metal ? kMostTissueHu : grey, range.least, range.most);
  }
};
// Of at least one value. `hounsfield`: they are CT.
GreyLimits GreyLimitsOf(std::span<const float> values, bool hounsfield);

// The image itself where there are none, as in most.
OwnOrLent<Volume> WithoutExtremes(const Volume& volume, bool hounsfield);

}  // namespace kvx
