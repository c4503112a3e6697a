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

// A mean of the bright samples around, near ones first. Dark samples (cortical bone) are told apart by
// themselves.
class MarrowLevel {
 public:
  explicit MarrowLevel(std::vector<LevelSample> samples);
  bool empty() const { return samples_.empty(); }
  double At(const PointMm& place) const;

 private:
  std::vector<LevelSample> samples_;  // the bright ones
};

// Intensities divided by the level: 1 is marrow, wherever the coil is. Air and below: 0.
Volume RelativeTo(const MarrowLevel& level, const Volume& volume);

}  // namespace kvx
