// A plane is an axis and a place, or a point and two directions.
#include "cli/slice_options.h"

#include <CLI/CLI.hpp>

#include "cli/commands.h"

namespace kvx {

SliceRequest SliceOptions::Request() const {
  if (slab_mm && projection == "none")
    throw UsageError("--slab-mm is how thick a projection is; give --projection max or mean too");
  SliceRequest request;
  request.projection = ProjectionFromName(projection);
  request.at_mm = at_mm, request.width_mm = width_mm, request.height_mm = height_mm;
  request.pixel_mm = pixel_mm, request.slab_mm = slab_mm;
  request.level = level;
  if (!axis.empty()) request.axis = SliceAxisFromName(axis);
  const bool oblique = !centre.empty() || !right.empty() || !down.empty();
  if (!oblique) return request;
  if (centre.size() != 3 || right.size() != 3 || down.size() != 3)
    throw UsageError("an oblique plane needs --centre, --right and --down, three numbers each");
  if (!axis.empty() || at_mm) throw UsageError("give --axis and --mm, or an oblique plane, not both");
  request.oblique = {
      {Eigen::Vector3d(centre.data())}, Eigen::Vector3d(right.data()), Eigen::Vector3d(down.data())};
  return request;
}

std::optional<Window> SliceOptions::AskedWindow() const {
  if (window.empty()) return {};
  if (window.size() != 2 || !(window[1] > window[0]))
    throw UsageError("--window takes LOW,HIGH with HIGH above LOW");
  return Window{float(window[0]), float(window[1])};
}

void AddSliceOptions(CLI::App& command, SliceOptions& options) {
  command.add_option("--axis", options.axis, "Plane across this axis (default: axial)")
      ->check(CLI::IsMember({"axial", "coronal", "sagittal"}));
  command.add_option("--mm", options.at_mm, "Where along the axis, LPS mm (default: the body's middle)");
  const auto vector = [&](const char* name, std::vector<double>& value, const char* help) {
    command.add_option(name, value, help)->delimiter(',')->expected(1, 3)->type_name("X,Y,Z");
  };
  vector("--centre", options.centre, "A point of an oblique plane, LPS mm");
  vector("--right", options.right, "Where the oblique picture's right side is, LPS");
  vector("--down", options.down, "Where its lower side is, LPS");
  command.add_option("--width-mm", options.width_mm, "Of the picture (default: the whole body)");
  command.add_option("--height-mm", options.height_mm, "Of the picture (default: the whole body)");
  command.add_option("--pixel-mm", options.pixel_mm,
                     "Size of a pixel (default: the template's smallest spacing, doubled per level)");
  command
      .add_option("--projection", options.projection,
                  "none: a slice; max, mean: through a slab along the line of sight")
      ->check(CLI::IsMember({"none", "max", "mean"}))
      ->capture_default_str();
  command.add_option("--slab-mm", options.slab_mm, "Thickness of the slab (default: the whole body)");
  command
      .add_option("--window", options.window,
                  "Intensities shown black and white (default: 1st and 99th percentile)")
      ->delimiter(',')
      ->expected(1, 2)
      ->type_name("LOW,HIGH");
  AddLevel(command, options.level);
}

}  // namespace kvx
