// Everything the stages of a study make, and the manifest that says where it lies.
#pragma once
#include <memory>
#include <vector>

#include "pipeline/bones/build_bone_set.h"
#include "pipeline/examples/example_moments.h"
#include "pipeline/measures/dilate_body.h"
#include "pipeline/model/model.h"
#include "pipeline/model/scan_steps.h"
#include "pipeline/posing/cut_bricks.h"
#include "pipeline/segmentation/segment_bones.h"
#include "pipeline/skeleton/fit_skeleton.h"
#include "pipeline/skinning/compute_weights.h"
#include "pipeline/skinning/segment_body.h"

namespace kvx {

struct StudySteps {
  std::unique_ptr<Step<LoadScan>> template_scan;
  std::vector<ScanSteps> scans;
  std::unique_ptr<Step<SegmentBones>> segmented;  // only of strokes or a threshold
  std::unique_ptr<Step<BuildBoneSet>> bones;
  std::unique_ptr<Step<SegmentBody>> body;
  std::unique_ptr<Step<ComputeWeights>> weights;
  std::unique_ptr<Step<DilateBody>> region;
  std::unique_ptr<Step<SettleBones>> settled;
  std::unique_ptr<Step<FitSkeleton>> skeleton;
  std::unique_ptr<Step<CompareExamples>> moments;
  std::unique_ptr<Step<CutBricks>> bricks;
};

// Keys, measures and seconds of finished steps; names, device, method and warnings are the caller's to add.
ModelManifest ManifestOf(StudySteps& steps);

}  // namespace kvx
