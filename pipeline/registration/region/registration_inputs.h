// What a registration of one scan is given.
#pragma once
#include <vector>

#include "core/bone.h"
#include "core/pose.h"
#include "core/scan.h"
#include "core/weight_map.h"
#include "pipeline/artifacts/stage_cache.h"

namespace kvx {

struct RegistrationInputs {
  const Artifact<Scan>& template_scan;
  const Artifact<Mask>& body;  // of the template
  const Artifact<BoneSet>& bones;
  const Artifact<WeightMap>& weights;
  const Artifact<BoneFits>& fits;  // of this scan
  const Artifact<Scan>& scan;
  std::vector<Digest> Keys() const {
    return {template_scan.key, body.key, bones.key, weights.key, fits.key, scan.key};
  }
};

}  // namespace kvx
