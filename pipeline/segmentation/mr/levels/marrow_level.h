// The intensity of marrow around a bone: a smooth field read from marks of the bone, which takes the place of
// a bias field.
#pragma once
#include <vector>

#include "core/image.h"

namespace kvx {

constexpr float kSurelyMarrow = 0.75f;  // of the level: no cortex, and not on a border

struct LevelSample {
  PointMm at;
  double intensity = 0;
};

// Of the voxels of a mask on the scan's grid.
std::vector<LevelSample> SamplesOf(const Volume& scan, const Mask& where);

// From the bright samples around, near ones first. Dark samples (cortical bone) are told apart by themselves.
// Where coils fade, samples lie on the bright side of a place at the end of a bone: a mean of them is too
// bright there, a plane through them is not. What lies in a small bone says too little of a slope.
class MarrowLevel {
 public:
  enum Fit { kMean, kPlane };

  explicit MarrowLevel(std::vector<LevelSample> samples, Fit fit = kMean);
  bool empty() const { return samples_.empty(); }
  double At(const PointMm& place) const;

 private:
  Fit fit_;
  std::vector<LevelSample> samples_;  // the bright ones
};

// Intensities divided by the level: 1 is marrow, wherever the coil is. Air and below: 0.
Volume RelativeTo(const MarrowLevel& level, const Volume& volume);

}  // namespace kvx
