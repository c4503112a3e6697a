// Motions as files: key frames as JSON, tables as CSV, motion capture as BVH.
#pragma once
#include <filesystem>
#include <map>
#include <optional>

#include "pipeline/posing/key_frames.h"

namespace kvx {

// Which column of a foreign file moves which of our joints: degrees = scale * value + offset_deg.
struct ChannelSource {
  std::string column;  // of a CSV its title, of a BVH "Joint.Xrotation"
  double scale = 1;
  double offset_deg = 0;
};
using ChannelMap = std::map<std::string, ChannelSource>;  // by our name, "tibia.flexion"

// {"tibia.flexion": "RightLeg.Xrotation", "patella.tilt":
// {"column": "kneecap", "scale": -1, "offset_deg": 5}}
ChannelMap ParseChannelMap(std::string_view json);

// In all readers `fps` counts instead of the file's own.

// {"fps": 25, "interpolation": "linear", "frames": [{"time": 0, "joints": {...}}, {"time": 1, "scan":
// "pose02"}, ...]}; a frame holds what a pose file holds. Throws InputError naming the field.
KeyFrames ParseKeyFrames(std::string_view json, std::optional<double> fps = {});
// A column `time` in seconds, others in degrees, as any program or spreadsheet saves them
// (core/text/csv_reader.h); without a map every other column is named as one of our motions. Frames per second
// are the rows', or 25 where these are fewer than 5 a second.
KeyFrames ParseMotionCsv(std::string_view text, const ChannelMap& map, std::optional<double> fps = {});
// JSON key frames where the text begins with a brace, else a table as CSV with our own names.
KeyFrames ParseMotion(std::string_view text);
// Rotations of the mapped channels; root translation and everything not mapped is left out.
KeyFrames ParseBvh(std::string_view text, const ChannelMap& map, std::optional<double> fps = {});

// By extension: .json, .csv, .bvh. `map` may be empty for .json and .csv.
KeyFrames ReadMotion(const std::filesystem::path& file, const ChannelMap& map,
                     std::optional<double> fps = {});

}  // namespace kvx
