// MR scans of so much noise that surfaces follow it.
#pragma once
#include <map>

#include "core/host/own_or_lent.h"
#include "core/image.h"

namespace kvx {

// The scan, smoothed by half a voxel if its noise in marrow is large. A surface that was found in noise
// looks clearer there than it is; here it does not. A scan of little noise is lent.
OwnOrLent<Volume> CalmScan(const Volume& scan, const LabelMap& strokes,
                           const std::map<int, double>& marrow_levels);

}  // namespace kvx
