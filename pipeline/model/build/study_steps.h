// Everything the stages of a study make, and the manifest that says where it lies.
#pragma once
#include <memory>
#include <set>
#include <string_view>
#include <vector>

#include "pipeline/bones/build_bone_set.h"
#include "pipeline/examples/example_moments.h"
#include "pipeline/measures/dilate_body.h"
#include "pipeline/model/build/scan_steps.h"
#include "pipeline/model/model.h"
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

  // What several of them take. Of lists of all scans the values are there when a step that takes them runs.
  std::unique_ptr<BoneTemplate> bone_template;
  std::vector<Artifact<BoneFits>> refined;  // by the scans' contents
  std::vector<Artifact<BoneFits>> fits;
  std::vector<Artifact<SampleExample::Output>> samples;
  std::unique_ptr<ExampleStack> stack;
};

// The stage graph: which stage takes what which other makes, by their names.
using StageEdges = std::set<std::pair<std::string_view, std::string_view>>;  // from, to
StageEdges EdgesOf(const StudySteps& steps);                                 // of the steps that there are

// Keys, measures and seconds of finished steps; names, device, method and warnings are the caller's to add.
ModelManifest ManifestOf(StudySteps& steps);

}  // namespace kvx
