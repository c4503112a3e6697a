// Another sequence shows the same tissues in other greys: the template's intensities as the scan would show
// them.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "core/image.h"

namespace kvx {

// A piecewise linear curve from template intensity to scan intensity.
struct ContrastMap {
  float low = 0, step = 1;  // intensity of the first knot, and from knot to knot
  std::vector<float> at_knot;
  float operator()(float value) const;
};

// As the scan would show it; without a curve as it is.
Volume Mapped(Volume volume, const std::optional<ContrastMap>& contrast);

// From intensities at the same places (where VBD puts them). Nothing where a straight line with positive
// slope explains them as well: then gain and bias are enough, and are not bent by what VBD puts in the wrong
// place.
std::optional<ContrastMap> FitContrast(std::span<const float> template_values,
                                       std::span<const float> scan_values);

}  // namespace kvx
