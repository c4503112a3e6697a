// The options that name a plane and its picture, shared by slice and animate.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "pipeline/pictures/slice_tiles.h"
#include "pipeline/posing/posed_slice.h"

namespace CLI {
class App;
}

namespace kvx {

struct SliceOptions {
  std::string axis, projection = "none";
  std::optional<double> at_mm, width_mm, height_mm, pixel_mm, slab_mm;
  std::vector<double> centre, right, down, window;
  int level = 0;

  // Without any of these an animation is of volumes, and a video a projection from the front.
  bool NamesPlane() const { return !axis.empty() || !centre.empty() || at_mm || projection != "none"; }
  bool Empty() const {
    return !NamesPlane() && !width_mm && !height_mm && !pixel_mm && !slab_mm && window.empty();
  }
  SliceRequest Request() const;  // throws UsageError
  std::optional<Window> AskedWindow() const;
};

void AddSliceOptions(CLI::App& command, SliceOptions& options);

}  // namespace kvx
