// Between which bones a place lies.
#pragma once
#include "core/bone.h"
#include "pipeline/registration/region/work_region.h"

namespace kvx {

struct NearestBones {
  int16_t first = kNoParent, second = kNoParent;  // the nearest and the next: indices into BoneSet::bones
  float second_mm = 0;                            // from the surface of the latter
};

// For every 2 x 2 x 2 voxels of the region, right to about a voxel; kNoParent where no bone is as near as
// `reach_mm`.
Image<NearestBones> NearestBonesAt(const BoneSet& bones, const WorkRegion& region, double reach_mm);

}  // namespace kvx
