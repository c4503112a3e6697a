// How much more easily a voxel of a CT is reached from a bone than from elsewhere.
#pragma once
#include "core/image.h"

namespace kvx {

// Ways through the density of a scan (ct_border.h).
struct CtWays {
  const Volume& density;
  double noise_hu = 0;
  double diagonal_mm = 0;        // of the box of a bone's strokes
  const Mask* within = nullptr;  // ways through these voxels only; none: through all

  // Millimetres from the mask's voxels, infinite beyond the most. The density's falls on the way are paid for
  // (from inside a bone outwards), or its rises (from outside inwards).
  Image<float> PayingFalls(const Mask& from, double most_mm) const;
  Image<float> PayingRises(const Mask& from, double most_mm) const;
};

// 1: bone for sure, -1: not. `other_mm` is finite.
float LeanOf(float own_mm, float other_mm);

}  // namespace kvx
