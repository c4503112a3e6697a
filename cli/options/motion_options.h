// The options that name a motion file, shared by animate and plan-poses.
#pragma once
#include "pipeline/model/files/motion_file.h"

namespace CLI {
class App;
}

namespace kvx {

struct MotionOptions {
  std::filesystem::path file, map;
  std::optional<double> fps;
  std::string interpolation;  // empty: as the file says

  KeyFrames Read() const;
};

void AddMotionOptions(CLI::App& command, MotionOptions& options, const std::string& name);

}  // namespace kvx
