// How the stages of a study hang together: what each takes, and what has to be loaded for that. Those of one
// training scan: scan_wiring.h.
#pragma once
#include <memory>

#include "core/study.h"
#include "pipeline/model/build/study_steps.h"

namespace kvx {

PoseHints HintsOf(const Study& study, const StudyScan& scan);

// Makes steps, runs none: what a step takes has to be a step by then, and need not have run. All arguments
// must outlive the steps.
class StudyWiring {
 public:
  StudyWiring(const StageCache& cache, Backend& backend, const Study& study, StudySteps& steps)
      : cache_(cache), backend_(backend), study_(study), steps_(steps) {}
  // Throws InputError or NotFound for a scan that cannot be read.
  std::unique_ptr<Step<LoadScan>> Loaded(const StudyScan& scan) const;
  std::unique_ptr<Step<SegmentBones>> Segmented() const;  // of strokes or a threshold
  std::unique_ptr<Step<BuildBoneSet>> Bones() const;      // of what was segmented, else of finished labels
  // All that follows from scans and bones, of every scan too, but what is decided by what is found: the steps
  // below. Loads the bones.
  void WireRest(const RegisterScan::Options& registration) const;
  std::unique_ptr<Step<CompleteExample>> Completed(int number) const;  // of the scan in the study's order
  std::unique_ptr<Step<CutBricks>> Bricks() const;  // one example is loaded after the other

 private:
  std::vector<int> ListedLabels() const;
  void WireBones() const;
  void WireExamples() const;
  const StageCache& cache_;
  Backend& backend_;
  const Study& study_;
  StudySteps& steps_;
};

}  // namespace kvx
