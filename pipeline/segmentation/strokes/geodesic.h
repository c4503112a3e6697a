// Distances from strokes through the image: a path pays for its length and for changes of intensity on
// its way.
#pragma once
#include "core/image.h"

namespace kvx {

struct GeodesicOptions {
  double mm_per_contrast = 60;  // the length that a change of the relative intensity by 1 costs
  double noise = 0.05;          // changes between neighbours up to this cost nothing
  double most_mm = 1e6;
  enum Paid { kChanges, kFalls, kRises } paid = kChanges;  // on the way from the source
  const Mask* within = nullptr;  // ways through these voxels only; none: through all
};

struct GeodesicSource {
  size_t voxel = 0;
  float head_start_mm = 0;  // what its distance begins with
};

// Millimetres from the nearest source (18 neighbours); infinity where it is farther than `most_mm`.
Image<float> GeodesicDistance(const Volume& relative, const std::vector<GeodesicSource>& from,
                              const GeodesicOptions& options);

}  // namespace kvx
