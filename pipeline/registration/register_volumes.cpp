// The stage is given one bone that owns every voxel and has none:
// the whole body follows the start and is free.
#include "pipeline/registration/register_volumes.h"

#include "pipeline/artifacts/held.h"
#include "pipeline/skinning/segment_body.h"

namespace kvx {
namespace {

WeightMap AllOfBoneZero(const Grid& grid) {
  VoxelWeights whole;
  whole.weights[0] = 1;
  return WeightMap(grid, whole);
}

BoneSet OneBoneWithoutVoxels(const Grid& grid) {
  BoneSet set;
  set.bones.push_back({.label = 1, .name = "body"});
  set.labels = LabelMap(grid);
  return set;
}

}  // namespace

RegisteredScan RegisterVolumes(const Scan& template_scan, const Scan& scan, const RigidTransform& start,
                               const RegisterScan::Options& options, StageContext& context) {
  const auto fixed = Held(template_scan), moving = Held(scan);
  StageContext silent{context.backend, {}};
  const Grid& grid = template_scan.volume.grid;
  const auto bones = Held(OneBoneWithoutVoxels(grid));
  const auto body = Held(SegmentBody::Run({fixed, bones}, {}, silent));
  const auto weights = Held(AllOfBoneZero(grid));
  BoneFits whole(1);
  whole[0].scan_from_template = start;
  const auto fits = Held(whole);
  return RegisterScan::Run({fixed, body, bones, weights, fits, moving}, options, context);
}

}  // namespace kvx
