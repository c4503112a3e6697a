// What a user is told about a label map that may not be what was meant.
#pragma once
#include <string>
#include <vector>

#include "core/bone.h"
#include "pipeline/segmentation/mend_labels.h"

namespace kvx {

// A line for the labels of the map, as it was given, that no bone has: they become soft tissue.
std::vector<std::string> UnusedLabels(const LabelMap& given, const BoneSet& bones);

// A line for what the stage `bones` takes from listed labels, and one for what it gives them.
std::vector<std::string> MendingWarnings(const MendedLabels& mended, const BoneSet& bones);

// All of these, of a finished label map.
std::vector<std::string> LabelWarnings(const LabelMap& given, const BoneSet& bones);

// A line for the bones that lie partly in air: a map of another scan, or one that a tool has mirrored or
// moved.
std::vector<std::string> BonesOutsideBody(const BoneSet& bones, const Mask& body);

}  // namespace kvx
