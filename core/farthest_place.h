// How far away anything may lie.
#pragma once
#include "core/frames.h"

namespace kvx {

// A kilometre, more than lies between the origins of two scans. What a number puts beyond is a mistake, and
// sums of such numbers may be no numbers.
constexpr double kFarthestMm = 1e6;

// Not what is nowhere (NaN).
inline bool LiesTooFar(const PointMm& x) { return (x.lps.array().abs() > kFarthestMm).any(); }

}  // namespace kvx
