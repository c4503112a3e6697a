// Where a step takes more than what others make, its last argument loads that when it has to run.
#include "pipeline/model/build/scan_wiring.h"

namespace kvx {

std::unique_ptr<Step<RegisterBones>> ScanWiring::Found(ScanSteps& s, const PoseHints& hints) const {
  return std::make_unique<Step<RegisterBones>>(
      cache_, backend_, RegisterBones::Inputs{*study_.bone_template, s.scan->artifact()},
      RegisterBones::Options{hints},
      [&study = study_, &s] { study.template_scan->Load(), study.bones->Load(), s.scan->Load(); });
}

std::unique_ptr<Step<RefineBones>> ScanWiring::Refined(ScanSteps& s, const PoseHints& hints) const {
  return std::make_unique<Step<RefineBones>>(
      cache_, backend_, RefineBones::Inputs{*study_.bone_template, s.scan->artifact(), s.found->artifact()},
      RefineBones::Options{hints}, [&study = study_, &s] {
        study.template_scan->Load(), study.bones->Load(), study.weights->Load(), s.scan->Load(),
            s.found->Load();
      });
}

std::unique_ptr<Step<ScanBones>> ScanWiring::Fits(int number) const {
  return MakeStep<ScanBones>(cache_, backend_, {number}, *study_.settled);
}

std::unique_ptr<Step<RegisterScan>> ScanWiring::Registered(ScanSteps& s,
                                                           const RegisterScan::Options& options) const {
  return MakeStep<RegisterScan>(cache_, backend_, options, *study_.template_scan, *study_.body, *study_.bones,
                                *study_.weights, *s.fits, *s.scan);
}

std::unique_ptr<Step<ComputeExample>> ScanWiring::Example(ScanSteps& s) const {
  return MakeStep<ComputeExample>(cache_, backend_, {}, *study_.body, *study_.weights, *s.fits,
                                  *s.registered);
}

std::unique_ptr<Step<ShownTissue>> ScanWiring::Shown(ScanSteps& s) const {
  return MakeStep<ShownTissue>(cache_, backend_, {}, *study_.body, *study_.weights, *s.fits, *study_.skeleton,
                               *s.registered, *study_.template_scan, *s.scan);
}

std::unique_ptr<Step<SampleExample>> ScanWiring::Samples(ScanSteps& s) const {
  return MakeStep<SampleExample>(cache_, backend_, {}, *study_.body, *s.example, *s.shown);
}

std::unique_ptr<Step<MeasureScan>> ScanWiring::Measures(ScanSteps& s) const {
  return MakeStep<MeasureScan>(cache_, backend_, {}, *study_.template_scan, *study_.region, *study_.weights,
                               *s.fits, *s.scan, *s.registered);
}

}  // namespace kvx
