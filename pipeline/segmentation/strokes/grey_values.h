// Whether what was given as labels is a scan.
#pragma once
#include <string>

#include "core/image.h"

namespace kvx {

// A label lies side by side with itself, a grey among other greys: whether most of the values do that, all
// but 0 and that of background strokes. However many they are, and however much they fill.
bool HoldsGreys(const LabelMap& labels);

// Throws InputError for strokes that hold greys.
void RequireNoGreys(const LabelMap& strokes);
// And for a map of whole bones.
void RequireNoScan(const LabelMap& labels, const std::string& name = "label map");

}  // namespace kvx
