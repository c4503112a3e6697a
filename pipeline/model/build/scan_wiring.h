// How the stages of one training scan hang together: what each takes, and what has to be loaded for that.
#pragma once
#include <memory>

#include "pipeline/model/build/study_steps.h"

namespace kvx {

// Makes steps, runs none: what a step takes has to be a step by then, and need not have run. Study and
// scan must outlive the steps.
class ScanWiring {
 public:
  ScanWiring(const StageCache& cache, Backend& backend, StudySteps& study)
      : cache_(cache), backend_(backend), study_(study) {}
  std::unique_ptr<Step<RegisterBones>> Found(ScanSteps& scan, const PoseHints& hints) const;
  std::unique_ptr<Step<RefineBones>> Refined(ScanSteps& scan, const PoseHints& hints) const;
  std::unique_ptr<Step<ScanBones>> Fits(int number) const;  // among those settled
  std::unique_ptr<Step<RegisterScan>> Registered(ScanSteps& scan, const RegisterScan::Options& options) const;
  std::unique_ptr<Step<ComputeExample>> Example(ScanSteps& scan) const;
  std::unique_ptr<Step<ShownTissue>> Shown(ScanSteps& scan) const;
  std::unique_ptr<Step<SampleExample>> Samples(ScanSteps& scan) const;
  std::unique_ptr<Step<MeasureScan>> Measures(ScanSteps& scan) const;

 private:
  const StageCache& cache_;
  Backend& backend_;
  StudySteps& study_;
};

}  // namespace kvx
