// study.json and pose files of the contract, checked once at the door. Degrees outside, radians inside.
#pragma once
#include <filesystem>
#include <string_view>

#include "core/pose.h"
#include "core/study.h"

namespace kvx {

// Paths are made absolute against the file's folder.
// Throws InputError naming the field that is wrong and what it should be.
Study ReadStudy(const std::filesystem::path& file);
Study ParseStudy(std::string_view json, const std::filesystem::path& base);

// {"joints": {...}} in degrees, or {"scan_from_template": {...}}, or {"scan": "pose01"}, and nothing else.
PoseRequest ParsePose(std::string_view json);
class JsonField;
PoseRequest PoseOf(const JsonField& pose);  // whatever else there is
PoseRequest ReadPose(const std::filesystem::path& file);

Region RegionFromName(std::string_view name);  // throws InputError
std::string_view NameOf(Region region);

}  // namespace kvx
