// Another sequence shows the same tissues in other greys: the template's intensities as the scan would show
// them.
#pragma once
#include <optional>
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

// Intensities at the same places.
struct GreyPairs {
  std::vector<float> in_template, in_scan;
  void Add(float of_template, float of_scan) {
    in_template.push_back(of_template), in_scan.push_back(of_scan);
  }
};

// From greys where VBD, or a bone's pose, puts them. Nothing where a straight line with positive slope
// explains them as well: then gain and bias are enough, and are not bent by what is in the wrong place.
std::optional<ContrastMap> FitContrast(const GreyPairs& pairs);

// As above, from `all`, of which most lies right; there is a curve as well where it explains much of what a
// line leaves, of all or of those that are `surely` of the same tissue. What is misplaced spreads greys, so
// that a curve explains little more than a line.
std::optional<ContrastMap> FitContrast(const GreyPairs& all, const GreyPairs& surely);

}  // namespace kvx
