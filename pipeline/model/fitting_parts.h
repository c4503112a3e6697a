// Whether a model's parts go with each other. Each is whole by its own digest; but a folder that somebody
// else gave may hold parts of several models, or what no build would make.
#pragma once
#include "kernels/bricked_body.h"
#include "pipeline/examples/example_moments.h"
#include "pipeline/skeleton/fit_skeleton.h"

namespace kvx {

struct ModelParts {
  const Grid& grid;  // the template's
  const BoneSet& bones;
  const SkeletonFit& fit;
  const Mask& body;
  std::span<const BoneFits> scan_fits;
  const ExampleMoments& moments;  // may be empty
};

bool GoTogether(const ModelParts& parts);
bool GoWith(const BoneSet& bones, const WeightMap& weights);
bool GoWith(const BoneSet& bones, const BrickedBody& bricks, size_t scans);

}  // namespace kvx
