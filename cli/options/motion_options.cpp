// Key frames, tables and motion capture by one option.
#include "cli/options/motion_options.h"

#include <CLI/CLI.hpp>

#include "cli/options/named_files.h"

namespace kvx {

KeyFrames MotionOptions::Read() const {
  ChannelMap channels;
  if (!map.empty()) {
    channels =
        FromFile(map, [](const std::filesystem::path& named) { return ParseChannelMap(ContentOf(named)); });
  }
  KeyFrames motion =
      FromFile(file, [&](const std::filesystem::path& named) { return ReadMotion(named, channels, fps); });
  if (!interpolation.empty()) motion.interpolation = InterpolationFromName(interpolation);
  Validate(motion);
  return motion;
}

void AddMotionOptions(CLI::App& command, MotionOptions& options, const std::string& name) {
  command
      .add_option(
          name, options.file,
          "Key frames (.json: {\"fps\": 25, \"frames\": [{\"time\": 0, \"joints\": {...}}, ...]}), a "
          "table (.csv: time and one column per motion, degrees) or motion capture (.bvh, with --map)")
      ->required()
      ->type_name("FILE");
  command
      .add_option(
          "--map", options.map,
          "JSON: which column moves which motion, {\"tibia.flexion\": \"RightLeg.Xrotation\"} or with "
          "{\"column\", \"scale\", \"offset_deg\"}")
      ->type_name("FILE");
  command
      .add_option(
          "--fps", options.fps,
          "Frames per second (default: the file's; of a table its rows', or 25 if they are fewer than 5 a "
          "second)")
      ->check(CLI::Range(0.001, 1000.0));
  command
      .add_option("--interpolation", options.interpolation,
                  "Between key frames (default: the file's, else linear)")
      ->check(CLI::IsMember({"linear", "slerp", "cubic"}));
}

}  // namespace kvx
