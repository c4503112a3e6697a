// Pose files of the contract: {"joints": {...}} in degrees, or {"scan_from_template": {...}}, or
// {"scan": "pose01"}, and nothing else.
#pragma once
#include <filesystem>
#include <string_view>

#include "core/pose.h"

namespace kvx {

// These throw InputError naming the field that is wrong.
PoseRequest ParsePose(std::string_view json);
PoseRequest ReadPose(const std::filesystem::path& file);

class JsonField;
PoseRequest PoseOf(const JsonField& pose);  // whatever else there is

}  // namespace kvx
