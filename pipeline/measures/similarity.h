// SSD, CC and MI of paired intensities on a 0..255 scale (paper, eq. 4 and 5).
#pragma once
#include <algorithm>
#include <span>

#include "core/image.h"
#include "core/measures.h"

namespace kvx {

// value -> 0..255: factor * (value - offset), clipped.
struct ByteScale {
  double offset = 0, factor = 1;
  float operator()(float value) const {
    return float(std::clamp(factor * (double(value) - offset), 0.0, 255.0));
  }
};
// CT (IsHounsfield) is windowed -1000..1500. Else values stay where nearly all (UsualRangeOf) lie within
// 0..255 and reach 16; others go from the least to the greatest, strays left out (RangeWithoutStraysOf).
ByteScale ByteScaleOf(const Volume& volume);

struct IntensityPair {
  float a = 0, b = 0;
};  // each 0..255

constexpr int kHistogramBins = 64;  // over [0, 256), both ways

// CC, -1..1; 0 where one image is flat. Of at least one pair.
double Correlation(std::span<const IntensityPair> pairs);

// Without pairs the images do not overlap, and the worst values come back: SSD 255, CC 0, MI 0.
// CC is 0 where one image is flat.
Measures Similarity(std::span<const IntensityPair> pairs);

}  // namespace kvx
