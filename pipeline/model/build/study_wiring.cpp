// Where a step takes more than what others make, its last argument loads that when it has to run.
#include "pipeline/model/build/study_wiring.h"

#include <algorithm>

#include "core/region_presets.h"
#include "pipeline/model/build/scan_wiring.h"

namespace kvx {
namespace {

template <class Stage>
using OfScan = std::unique_ptr<Step<Stage>> ScanSteps::*;

// Known by their keys; their values may not be there.
template <class Stage>
std::vector<Artifact<typename Stage::Output>> ArtifactsOf(const std::vector<ScanSteps>& scans,
                                                          OfScan<Stage> step) {
  std::vector<Artifact<typename Stage::Output>> out;
  for (const ScanSteps& scan : scans) out.push_back((scan.*step)->artifact());
  return out;
}

template <class Stage>
std::vector<Artifact<typename Stage::Output>> LoadedOf(const std::vector<ScanSteps>& scans,
                                                       OfScan<Stage> step) {
  for (const ScanSteps& scan : scans) (scan.*step)->Load();
  return ArtifactsOf(scans, step);
}

// By what the scans hold, whatever their order in the study: sums round by their order, and registration
// makes much of little.
std::vector<Artifact<BoneFits>> RefinedByContent(const std::vector<ScanSteps>& scans) {
  std::vector<const ScanSteps*> ordered;
  for (const ScanSteps& scan : scans) ordered.push_back(&scan);
  std::ranges::sort(ordered, {}, [](const ScanSteps* scan) {
    return std::pair(scan->scan->InputKeys(), scan->refined->key());
  });
  std::vector<Artifact<BoneFits>> out;
  for (const ScanSteps* scan : ordered) out.push_back(scan->refined->artifact());
  return out;
}

}  // namespace

PoseHints HintsOf(const Study& study, const StudyScan& scan) {
  const auto hints = study.initial_poses.find(scan.name);
  return hints == study.initial_poses.end() ? PoseHints{} : hints->second;
}

std::unique_ptr<Step<LoadScan>> StudyWiring::Loaded(const StudyScan& scan) const {
  const LoadScan::Inputs inputs{ContentDigest(scan.volume), scan.volume};
  return std::make_unique<Step<LoadScan>>(cache_, backend_, inputs, NoOptions{}, [] {});
}

// Strokes of anything else would be lost without a word.
std::vector<int> StudyWiring::ListedLabels() const {
  std::vector<int> labels;
  for (const StudyBone& bone : study_.bones) labels.push_back(bone.label);
  const int preset = study_.bones.empty() ? int(RegionPreset(study_.region).size()) : 0;
  for (int label = 1; label <= preset; ++label) labels.push_back(label);
  return labels;
}

std::unique_ptr<Step<SegmentBones>> StudyWiring::Segmented() const {
  const bool strokes = !study_.bone_seeds.empty();
  const SegmentBones::Inputs inputs{steps_.template_scan->artifact(),
                                    strokes ? ContentDigest(study_.bone_seeds) : Digest{}, study_.bone_seeds};
  return std::make_unique<Step<SegmentBones>>(cache_, backend_, inputs,
                                              SegmentBones::Options{study_.bone_level_hu, ListedLabels()},
                                              [&steps = steps_] { steps.template_scan->Load(); });
}

std::unique_ptr<Step<BuildBoneSet>> StudyWiring::Bones() const {
  const bool finished = !steps_.segmented;
  const BuildBoneSet::Inputs inputs{
      steps_.template_scan->artifact(),
      finished ? LabelsDigest(study_.bone_labels, study_.bones) : steps_.segmented->key(), study_.bone_labels,
      finished ? nullptr : &steps_.segmented->artifact()};
  return std::make_unique<Step<BuildBoneSet>>(
      cache_, backend_, inputs, BuildBoneSet::Options{study_.region, study_.bones}, [&steps = steps_] {
        steps.template_scan->Load();
        if (steps.segmented) steps.segmented->Load();
      });
}

void StudyWiring::WireBones() const {
  StudySteps& steps = steps_;
  steps.bone_template = std::make_unique<BoneTemplate>(steps.template_scan->artifact(),
                                                       steps.bones->artifact(), steps.weights->artifact());
  const ScanWiring scans(cache_, backend_, steps);
  for (ScanSteps& scan : steps.scans) {
    scan.found = scans.Found(scan, HintsOf(study_, scan.study));
    scan.refined = scans.Refined(scan, HintsOf(study_, scan.study));
  }
  steps.refined = RefinedByContent(steps.scans);
  steps.settled = std::make_unique<Step<SettleBones>>(
      cache_, backend_, SettleBones::Inputs{steps.bones->artifact(), steps.refined},
      SettleBones::Options{study_.region, study_.joints}, [&steps] {
        steps.bones->Load();
        for (ScanSteps& scan : steps.scans) scan.refined->Load();
        steps.refined = RefinedByContent(steps.scans);
      });
  for (ScanSteps& scan : steps.scans) {
    const auto place = std::ranges::find(steps.refined, scan.refined->key(), &Artifact<BoneFits>::key);
    scan.fits = scans.Fits(int(place - steps.refined.begin()));
  }
  steps.fits = ArtifactsOf(steps.scans, &ScanSteps::fits);
  FitSkeleton::Options options;
  options.region = study_.region;
  options.joints = study_.joints;
  steps.skeleton = std::make_unique<Step<FitSkeleton>>(
      cache_, backend_, FitSkeleton::Inputs{steps.bones->artifact(), steps.fits}, options, [&steps] {
        steps.bones->Load();
        steps.fits = LoadedOf(steps.scans, &ScanSteps::fits);
      });
}

void StudyWiring::WireExamples() const {
  StudySteps& steps = steps_;
  const ScanWiring scans(cache_, backend_, steps);
  std::vector<ExampleStack::Scan> stacked;
  for (ScanSteps& s : steps.scans) {
    s.example = scans.Example(s);
    s.shown = scans.Shown(s);
    s.samples = scans.Samples(s);
    s.measures = scans.Measures(s);
    stacked.push_back({s.example->key(), s.shown->key(), [&s] { return s.example->Borrow(); },
                       [&s] { return s.shown->Borrow(); }});
  }
  steps.stack = std::make_unique<ExampleStack>(steps.body->artifact(), std::move(stacked));
  steps.samples = ArtifactsOf(steps.scans, &ScanSteps::samples);
  steps.moments = std::make_unique<Step<CompareExamples>>(
      cache_, backend_,
      CompareExamples::Inputs{steps.body->artifact(), steps.weights->artifact(), steps.skeleton->artifact(),
                              steps.samples},
      CompareExamples::Options{int(steps.bones->Load().bones.size())}, [&steps] {
        steps.body->Load(), steps.weights->Load(), steps.skeleton->Load();
        steps.samples = LoadedOf(steps.scans, &ScanSteps::samples);
      });
}

void StudyWiring::WireRest(const RegisterScan::Options& registration) const {
  steps_.body = MakeStep<SegmentBody>(cache_, backend_, {}, *steps_.template_scan, *steps_.bones);
  steps_.weights = MakeStep<ComputeWeights>(cache_, backend_, {}, *steps_.bones, *steps_.body);
  steps_.region = MakeStep<DilateBody>(cache_, backend_, {}, *steps_.body);
  WireBones();
  const ScanWiring scans(cache_, backend_, steps_);
  for (ScanSteps& scan : steps_.scans) scan.registered = scans.Registered(scan, registration);
  WireExamples();
}

std::unique_ptr<Step<CompleteExample>> StudyWiring::Completed(int number) const {
  return std::make_unique<Step<CompleteExample>>(
      cache_, backend_,
      CompleteExample::Inputs{*steps_.stack, steps_.body->artifact(), steps_.weights->artifact(),
                              steps_.skeleton->artifact(), steps_.moments->artifact()},
      CompleteExample::Options{number}, [&steps = steps_] {
        steps.body->Load(), steps.weights->Load(), steps.skeleton->Load(), steps.moments->Load();
      });
}

std::unique_ptr<Step<CutBricks>> StudyWiring::Bricks() const {
  std::vector<Digest> examples;
  for (const ScanSteps& s : steps_.scans) examples.push_back(ExampleKey(s));
  const auto load_example = [&steps = steps_](size_t k) { return BorrowExample(steps.scans[k]); };
  return std::make_unique<Step<CutBricks>>(
      cache_, backend_,
      CutBricks::Inputs{steps_.body->artifact(), steps_.bones->artifact(), steps_.weights->artifact(),
                        examples, load_example},
      NoOptions{}, [&steps = steps_] { steps.body->Load(), steps.bones->Load(), steps.weights->Load(); });
}

}  // namespace kvx
