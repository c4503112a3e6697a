// A plane through a posed body, and how it becomes a picture.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/frames.h"

namespace kvx {

enum class SliceAxis : uint8_t { kAxial, kCoronal, kSagittal };
std::string NameOf(SliceAxis axis);
SliceAxis SliceAxisFromName(const std::string& name);  // throws InputError

enum class Projection : uint8_t { kNone, kMaximum, kMean };
std::string NameOf(Projection projection);               // "none", "max", "mean"
Projection ProjectionFromName(const std::string& name);  // throws InputError

// What a user asks for. Directions are LPS; what is left out follows from the posed body.
struct SliceRequest {
  std::optional<SliceAxis> axis;  // else axial
  std::optional<double> at_mm;    // along the axis: z, y or x of the plane; else through the body's middle
  struct Oblique {
    PointMm centre;
    Eigen::Vector3d right, down;  // of the picture; made orthonormal
    std::array<Eigen::Vector3d, 3> Vectors() const { return {centre.lps, right, down}; }
  };
  std::optional<Oblique> oblique;             // instead of an axis
  std::optional<double> width_mm, height_mm;  // else what shows the whole body
  std::optional<double> pixel_mm;             // else the template's smallest spacing, doubled per level
  int level = 0;                              // each halves the picture: a pixel is the mean of 2 x 2
  Projection projection = Projection::kNone;
  std::optional<double> slab_mm;                    // of a projection; else the whole body
  std::optional<std::pair<double, double>> window;  // intensities shown black and white

  SliceAxis Axis() const { return axis.value_or(SliceAxis::kAxial); }
  bool NamesPlane() const { return axis || at_mm || oblique || projection != Projection::kNone; }
  // Nothing said but a level, which volumes have too.
  bool Empty() const { return !NamesPlane() && !width_mm && !height_mm && !pixel_mm && !slab_mm && !window; }
  SliceRequest OfVideo() const;  // where no plane is named: a projection of the whole body from the front
  void Validate() const;         // throws InputError for what does not go together
};

// Three numbers each, or none: nothing. Throws InputError for what is between.
std::optional<SliceRequest::Oblique> ObliqueOf(const std::vector<double>& centre,
                                               const std::vector<double>& right,
                                               const std::vector<double>& down);
// Two numbers, or none: nothing. Throws InputError.
std::optional<std::pair<double, double>> WindowOf(const std::vector<double>& black_and_white);

}  // namespace kvx
