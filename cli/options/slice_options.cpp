// A plane is an axis and a place, or a point and two directions.
#include "cli/options/slice_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "cli/commands.h"
#include "pipeline/posing/posed_slice.h"

namespace kvx {

SliceRequest SliceOptions::Request() const try {
  SliceRequest request = numbers;
  if (!axis.empty()) request.axis = SliceAxisFromName(axis);
  request.projection = ProjectionFromName(projection);
  request.oblique = ObliqueOf(centre, right, down);
  request.window = WindowOf(window);
  return request;
} catch (const InputError& error) {
  throw UsageError(WithOptionNames(error.what()));
}

void RequireFitting(const SliceRequest& view) {
  try {
    view.Validate();
  } catch (const InputError& error) {
    throw UsageError(WithOptionNames(error.what()));
  }
}

std::string WithOptionNames(std::string sentence) {
  for (const std::string name : {"axis", "mm", "centre", "right", "down", "projection", "slab_mm", "width_mm",
                                 "height_mm", "pixel_mm", "window"}) {
    const std::string quoted = "'" + name + "'";
    std::string option = "--" + name;
    std::ranges::replace(option, '_', '-');
    for (size_t at; (at = sentence.find(quoted)) != sentence.npos;)
      sentence.replace(at, quoted.size(), option);
  }
  return sentence;
}

void WarnOfPlane(const SliceRequest& view, const Grid& posed_body) {
  const auto room = RoomBesidePlane(view, posed_body);
  if (!room) return;
  char reach[64] = "";
  if (!view.oblique)
    std::snprintf(reach, sizeof reach, ", which reaches from %.1f to %.1f mm", room->from_mm, room->to_mm);
  Warn("the plane lies beside the posed body" + std::string(reach) + ": the picture is empty");
}

void AddSliceOptions(CLI::App& command, SliceOptions& options) {
  command.add_option("--axis", options.axis, "Plane across this axis (default: axial)")
      ->check(CLI::IsMember({"axial", "coronal", "sagittal"}));
  command.add_option("--mm", options.numbers.at_mm,
                     "Where along the axis, LPS mm (default: the body's middle)");
  const auto vector = [&](const char* name, std::vector<double>& value, const char* help) {
    command.add_option(name, value, help)->delimiter(',')->expected(1, 3)->type_name("X,Y,Z");
  };
  vector("--centre", options.centre, "A point of an oblique plane, LPS mm");
  vector("--right", options.right, "Where the oblique picture's right side is, LPS");
  vector("--down", options.down, "Where its lower side is, LPS");
  command.add_option("--width-mm", options.numbers.width_mm, "Of the picture (default: the whole body)")
      ->check(AboveZero());
  command.add_option("--height-mm", options.numbers.height_mm, "Of the picture (default: the whole body)")
      ->check(AboveZero());
  command
      .add_option("--pixel-mm", options.numbers.pixel_mm,
                  "Size of a pixel (default: the template's smallest spacing, doubled per level)")
      ->check(AboveZero());
  command
      .add_option("--projection", options.projection,
                  "none: a slice; max, mean: through a slab along the line of sight")
      ->check(CLI::IsMember({"none", "max", "mean"}))
      ->capture_default_str();
  command.add_option("--slab-mm", options.numbers.slab_mm, "Thickness of the slab (default: the whole body)")
      ->check(AboveZero());
  command
      .add_option("--window", options.window,
                  "Intensities shown black and white (default: 1st and 99th percentile)")
      ->delimiter(',')
      ->expected(1, 2)
      ->type_name("LOW,HIGH");
  AddLevel(command, options.numbers.level);
}

}  // namespace kvx
