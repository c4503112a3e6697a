// What registering the template to one scan found (paper, section 4).
#pragma once
#include <cstdint>
#include <vector>

#include "core/image.h"

namespace kvx {

// How far off the place of a voxel may be is stored in steps.
constexpr double kPlaceErrorStepMm = 0.05;
constexpr uint8_t kPlaceErrorUnknown = 255;  // or more than the steps can say
constexpr uint8_t kPlaceErrorInDoubt = 254;  // shown, but its bone is in doubt: it may be another tissue

constexpr int kUnsurePercent = 50;

// Of the body: how likely it is, in per cent, that a voxel's place is right to half a voxel. A method that
// states no confidence is sure of nothing.
struct ConfidenceSummary {
  double mean_percent = 0;
  double unsure_fraction = 1;  // below kUnsurePercent
};

struct RegisteredScan {
  DisplacementField scan_from_template;  // on the template grid, mm: v-hat = v + u(v); smooth beyond the body
  // Allocated over all levels and rounds, as the paper counts them (8 per registered block)
  int64_t control_points = 0;
  std::vector<int64_t> control_points_per_level;
  double folded_fraction = 0;  // of body voxels whose Jacobian determinant is not positive
  Mask place_error_steps;      // of kPlaceErrorStepMm, on the template grid; empty where the method states none
  ConfidenceSummary confidence;
};

}  // namespace kvx
