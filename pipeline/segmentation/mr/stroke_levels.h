// What the strokes of an MR scan say before anything is looked for: where bones lie, how bright their marrow
// is, and where air is for that.
#pragma once
#include <map>
#include <vector>

#include "pipeline/segmentation/strokes/found_bone.h"

namespace kvx {

// Without the background's.
std::vector<StrokeBox> StrokeBoxes(const LabelMap& strokes);

// Intensity of marrow, by label: bright strokes lie in marrow.
std::map<int, double> MarrowLevels(const Volume& scan, const LabelMap& strokes);

// 1 in air, by the bone whose marrow is dimmest.
LabelMap AirBeside(const Volume& scan, const std::map<int, double>& marrow_levels);

}  // namespace kvx
