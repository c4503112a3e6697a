// Inputs name artifacts; the last argument of a step loads them when it has to run.
#include "pipeline/model/scan_wiring.h"

namespace kvx {

std::unique_ptr<Step<RegisterBones>> ScanWiring::Found(
    ScanSteps& s, BoneTemplate& bones, const std::map<std::string, RigidTransform>& hints) const {
  return std::make_unique<Step<RegisterBones>>(
      cache_, backend_, RegisterBones::Inputs{bones, s.scan->artifact()}, RegisterBones::Options{hints},
      [&study = study_, &s] { study.template_scan->Load(), study.bones->Load(), s.scan->Load(); });
}

std::unique_ptr<Step<RefineBones>> ScanWiring::Refined(ScanSteps& s, BoneTemplate& bones) const {
  return std::make_unique<Step<RefineBones>>(
      cache_, backend_, RefineBones::Inputs{bones, s.scan->artifact(), s.found->artifact()}, NoOptions{},
      [&study = study_, &s] {
        study.template_scan->Load(), study.bones->Load(), study.weights->Load(), s.scan->Load(),
            s.found->Load();
      });
}

std::unique_ptr<Step<ScanBones>> ScanWiring::Fits(int number) const {
  return std::make_unique<Step<ScanBones>>(cache_, backend_, ScanBones::Inputs{study_.settled->artifact()},
                                           ScanBones::Options{number},
                                           [&study = study_] { study.settled->Load(); });
}

std::unique_ptr<Step<RegisterScan>> ScanWiring::Registered(ScanSteps& s,
                                                           const RegisterScan::Options& options) const {
  return std::make_unique<Step<RegisterScan>>(
      cache_, backend_,
      RegisterScan::Inputs{study_.template_scan->artifact(), study_.body->artifact(),
                           study_.bones->artifact(), study_.weights->artifact(), s.fits->artifact(),
                           s.scan->artifact()},
      options, [&study = study_, &s] {
        study.template_scan->Load(), study.body->Load(), study.bones->Load(), study.weights->Load(),
            s.fits->Load(), s.scan->Load();
      });
}

std::unique_ptr<Step<ComputeExample>> ScanWiring::Example(ScanSteps& s) const {
  return std::make_unique<Step<ComputeExample>>(
      cache_, backend_,
      ComputeExample::Inputs{study_.body->artifact(), study_.weights->artifact(), s.fits->artifact(),
                             s.registered->artifact()},
      NoOptions{}, [&study = study_, &s] {
        study.body->Load(), study.weights->Load(), s.fits->Load(), s.registered->Load();
      });
}

std::unique_ptr<Step<ShownTissue>> ScanWiring::Shown(ScanSteps& s) const {
  return std::make_unique<Step<ShownTissue>>(
      cache_, backend_,
      ShownTissue::Inputs{study_.body->artifact(), study_.weights->artifact(), s.fits->artifact(),
                          study_.skeleton->artifact(), s.registered->artifact(),
                          study_.template_scan->artifact(), s.scan->artifact()},
      NoOptions{}, [&study = study_, &s] {
        study.body->Load(), study.weights->Load(), s.fits->Load(), study.skeleton->Load(),
            s.registered->Load();
        study.template_scan->Load(), s.scan->Load();
      });
}

std::unique_ptr<Step<SampleExample>> ScanWiring::Samples(ScanSteps& s) const {
  return std::make_unique<Step<SampleExample>>(
      cache_, backend_,
      SampleExample::Inputs{study_.body->artifact(), s.example->artifact(), s.shown->artifact()}, NoOptions{},
      [&study = study_, &s] { study.body->Load(), s.example->Load(), s.shown->Load(); });
}

std::unique_ptr<Step<CompleteExample>> ScanWiring::Completed(int number, ExampleStack& examples) const {
  return std::make_unique<Step<CompleteExample>>(
      cache_, backend_,
      CompleteExample::Inputs{examples, study_.body->artifact(), study_.weights->artifact(),
                              study_.skeleton->artifact(), study_.moments->artifact()},
      CompleteExample::Options{number}, [&study = study_] {
        study.body->Load(), study.weights->Load(), study.skeleton->Load(), study.moments->Load();
      });
}

std::unique_ptr<Step<MeasureScan>> ScanWiring::Measures(ScanSteps& s) const {
  return std::make_unique<Step<MeasureScan>>(
      cache_, backend_,
      MeasureScan::Inputs{study_.template_scan->artifact(), study_.region->artifact(),
                          study_.weights->artifact(), s.fits->artifact(), s.scan->artifact(),
                          s.registered->artifact()},
      NoOptions{}, [&study = study_, &s] {
        study.template_scan->Load(), study.region->Load(), study.weights->Load(), s.fits->Load(),
            s.scan->Load(), s.registered->Load();
      });
}

}  // namespace kvx
