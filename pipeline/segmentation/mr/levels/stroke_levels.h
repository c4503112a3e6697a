// What the strokes of an MR scan say before anything is looked for: how bright marrow is, and so where air
// is.
#pragma once
#include <map>

#include "core/image.h"

namespace kvx {

// Intensity of marrow, by label: bright strokes lie in marrow.
std::map<int, double> MarrowLevels(const Volume& scan, const LabelMap& strokes);

// 1 in air, by the bone whose marrow is dimmest.
LabelMap AirBeside(const Volume& scan, const std::map<int, double>& marrow_levels);

}  // namespace kvx
