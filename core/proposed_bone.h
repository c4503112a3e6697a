// What a label of a label map looks like, and which bone of the region it may be.
#pragma once
#include <optional>
#include <string>

#include "core/frames.h"

namespace kvx {

struct ProposedBone {
  int label = 0;
  size_t voxels = 0;
  double cm3 = 0;
  PointMm centre;            // of its voxels
  std::string name, parent;  // empty name: the region's preset has none for it; empty parent: the root
  double confidence = 0;     // of the name, 0 to 1; below kSureName somebody should look
  std::string looks_like;    // another name, where it looks more like that
  std::optional<double> expected_dice = {};  // of its voxels with the true bone's; of an MR's strokes only
};
constexpr double kSureName = 0.5;

}  // namespace kvx
