// Stage `body`: the body mask of the template.
#pragma once
#include "core/bone.h"
#include "pipeline/runner.h"

namespace kvx {

// Voxels brighter than 0.35 of the way from air to the tissue around them, without small or dim pieces, holes
// (bones, vessels) and dim tissue between bright one filled (`WithDimTissue`); without other limbs, and in CT
// without tables and casts (`WithoutSurroundings`), and with dark bone in its gaps (`WithDarkBone`). A scan
// without air is all body.
struct SegmentBody {
  static constexpr std::string_view kName = "body";
  static constexpr int kVersion = 6;
  struct Inputs {
    const Artifact<Scan>& scan;
    const Artifact<BoneSet>& bones;
    std::vector<Digest> Keys() const { return {scan.key, bones.key}; }
  };
  using Options = NoOptions;
  using Output = Mask;  // on the scan's grid
  static Output Run(const Inputs& inputs, const Options&, StageContext& context);
};

}  // namespace kvx
