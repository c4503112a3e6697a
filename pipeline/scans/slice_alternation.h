// Every other slice brighter than those beside it: slices that an MR scanner took in two passes.
#pragma once
#include <optional>

#include "core/scan.h"

namespace kvx {

// Along one axis of the grid: slices 0, 2, 4, ... are exp(2 log_gain) times as bright as those between them.
struct SliceAlternation {
  int axis = 0;
  double log_gain = 0;
};

// The strongest, where it stands out from what anatomy and noise make of one. Of bright voxels alone.
std::optional<SliceAlternation> FindSliceAlternation(const Volume& volume);

// Divides it out along every axis that has one: template and scan would be laid stripe on stripe. Returns by
// which part the brighter slices exceeded the others at most, 0 where there was none. Hounsfield units stay.
double EvenSlices(Scan& scan);

}  // namespace kvx
