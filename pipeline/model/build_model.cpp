// The stage graph of a model (docs/architecture.md), run in order; voxels are held for one scan at a time.
#include "pipeline/model/build_model.h"

#include <algorithm>
#include <iterator>

#include "pipeline/bones/build_bone_set.h"
#include "pipeline/bones/region_presets.h"
#include "pipeline/examples/example_moments.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/measures/dilate_body.h"
#include "pipeline/model/bone_warnings.h"
#include "pipeline/model/model_folder.h"
#include "pipeline/model/progress_shares.h"
#include "pipeline/model/scan_steps.h"
#include "pipeline/model/study_file.h"
#include "pipeline/model/study_warnings.h"
#include "pipeline/posing/cut_bricks.h"
#include "pipeline/skinning/compute_weights.h"
#include "pipeline/skinning/segment_body.h"

namespace kvx {
namespace {

// Expected cost of the stages relative to each other, for progress only; register and register_bones are per
// scan.
constexpr double kLoadCost = 1, kBonesCost = 2, kRegisterBonesCost = 8, kJointsCost = 1, kWeightsCost = 8,
                 kRegisterCost = 30, kExamplesCost = 2, kMeasuresCost = 2, kCompleteCost = 2, kBricksCost = 1;
// Of the body, hidden from a scan, from which on its example is completed
constexpr double kLeastHidden = 0.002;

// Says which part of the study an error is about.
template <class F>
auto About(const std::string& part, F&& action) {
  try {
    return action();
  } catch (const InputError& error) {
    throw InputError(part + ": " + error.what());
  } catch (const NotFound& error) {
    throw InputError(part + ": " + error.what());
  }
}

// What a time limit leaves depends on the machine:
// such a result has a key of its own and is never found again.
PaperOptions PaperOptionsOf(const BuildOptions& options) {
  PaperOptions paper = options.paper;
  if (paper.max_seconds > 0) paper.run = std::chrono::system_clock::now().time_since_epoch().count();
  return paper;
}

using LoadStep = Step<LoadScan>;

std::unique_ptr<LoadStep> MakeLoadStep(const StageCache& cache, Backend& backend, const StudyScan& scan) {
  return About("scan '" + scan.name + "'", [&] {
    const LoadScan::Inputs inputs{ContentDigest(scan.volume), scan.volume};
    return std::make_unique<LoadStep>(cache, backend, inputs, NoOptions{}, [] {});
  });
}

class Build {
 public:
  Build(const Study& study, const BuildOptions& options, const StageCache& cache, Backend& backend,
        const Progress& progress)
      : study_(study),
        options_(options),
        cache_(cache),
        backend_(backend),
        shares_(progress, TotalCost(study.scans.size())) {}

  ModelManifest Run() {
    LoadScans();
    FindBones();
    WeighBody();
    PlaceBones();
    FitJoints();
    for (ScanSteps& scan : scans_) RegisterOne(scan);
    Compare();
    Complete();
    CutIntoBricks();
    return Manifest();
  }

 private:
  static double TotalCost(size_t scans) {  // the template among them
    const double registered = scans > 0 ? double(scans - 1) : 0.0;
    return double(scans) * kLoadCost + kBonesCost + kJointsCost + kWeightsCost + kCompleteCost + kBricksCost +
           registered * (kRegisterBonesCost + kRegisterCost + kExamplesCost + kMeasuresCost);
  }

  void LoadScans() {
    std::vector<std::pair<std::string, Digest>> files;
    for (const StudyScan& scan : study_.scans) {
      const Progress part = Named(shares_.Next(kLoadCost), "load");
      part.Report("load", 0.0);
      auto step = MakeLoadStep(cache_, backend_, scan);
      About("scan '" + scan.name + "'", [&] { step->Make(part); });
      step->Release();
      files.emplace_back(scan.name, step->key());
      if (scan.name == study_.template_scan)
        template_ = std::move(step);
      else
        scans_.push_back({.study = scan, .scan = std::move(step)});
    }
    if (!template_)
      throw InputError("the study's template is not one of its scans; name one of them in \"template\"");
    AddWarnings(SameScanWarnings(files));
  }

  // Strokes or a threshold make a label map first; a finished one goes straight on.
  void Segment(const Progress& progress) {
    const bool strokes = !study_.bone_seeds.empty();
    const SegmentBones::Inputs inputs{
        template_->artifact(), strokes ? ContentDigest(study_.bone_seeds) : Digest{}, study_.bone_seeds};
    segmented_ = std::make_unique<Step<SegmentBones>>(
        cache_, backend_, inputs, SegmentBones::Options{study_.bone_level_hu, ListedLabels()},
        [this] { template_->Load(); });
    segmented_->Make(progress);
  }

  // Strokes of anything else would be lost without a word.
  std::vector<int> ListedLabels() const {
    std::vector<int> labels;
    for (const StudyBone& bone : study_.bones) labels.push_back(bone.label);
    const int preset = study_.bones.empty() ? int(RegionPreset(study_.region).size()) : 0;
    for (int label = 1; label <= preset; ++label) labels.push_back(label);
    return labels;
  }

  void FindBones() {
    const bool segment = !study_.bone_seeds.empty() || study_.bones_by_threshold;
    if (study_.bone_labels.empty() && !segment) {
      throw InputError(
          "the study names no bone labels; give a label map on the template in \"bones\": {\"labels\": ...}");
    }
    const Progress part = Named(shares_.Next(kBonesCost), "bones");
    About("bones", [&] {
      if (segment) Segment(part.Part(0.0, 0.8));
      const BuildBoneSet::Inputs inputs{template_->artifact(),
                                        segment ? segmented_->key() : ContentDigest(study_.bone_labels),
                                        study_.bone_labels, segment ? &segmented_->artifact() : nullptr};
      bones_ = std::make_unique<Step<BuildBoneSet>>(
          cache_, backend_, inputs, BuildBoneSet::Options{study_.region, study_.bones}, [this] {
            template_->Load();
            if (segmented_) segmented_->Load();
          });
      bones_->Make(part.Part(segment ? 0.8 : 0.0, 1.0));
      AddWarnings(segmented_ ? segmented_->Load().warnings : LabelWarnings(bones_->Load()));
      AddWarnings(NameWarnings(bones_->Load(), study_.region));
      AddWarnings(ParentWarnings(bones_->Load()));
      if (segmented_) segmented_->Release();
    });
  }

  void PlaceBones() {
    bone_template_ =
        std::make_unique<BoneTemplate>(template_->artifact(), bones_->artifact(), weights_->artifact());
    for (ScanSteps& scan : scans_) RegisterBonesOf(scan);
    for (ScanSteps& scan : scans_) {
      scan.refined->Load();  // small: stays
      refined_.push_back(scan.refined->artifact());
    }
    bone_template_->Forget();
    settled_ = std::make_unique<Step<SettleBones>>(
        cache_, backend_, SettleBones::Inputs{bones_->artifact(), refined_},
        SettleBones::Options{study_.region, study_.joints}, [this] { bones_->Load(); });
    About("joints", [&] { settled_->Make({}); });
    for (size_t k = 0; k < scans_.size(); ++k) {
      scans_[k].fits =
          std::make_unique<Step<ScanBones>>(cache_, backend_, ScanBones::Inputs{settled_->artifact()},
                                            ScanBones::Options{int(k)}, [this] { settled_->Load(); });
      scans_[k].fits->Make({});
    }
  }

  std::map<std::string, RigidTransform> HintsOf(const ScanSteps& scan) const {
    const auto hints = study_.initial_poses.find(scan.study.name);
    return hints == study_.initial_poses.end() ? std::map<std::string, RigidTransform>{} : hints->second;
  }

  void RegisterBonesOf(ScanSteps& scan) {
    RegisterBones::Options options;
    options.initial_poses = HintsOf(scan);
    scan.found = std::make_unique<Step<RegisterBones>>(
        cache_, backend_, RegisterBones::Inputs{*bone_template_, scan.scan->artifact()}, options,
        [this, &scan] { template_->Load(), bones_->Load(), scan.scan->Load(); });
    const Progress part = Named(shares_.Next(kRegisterBonesCost), "register_bones " + scan.study.name);
    scan.found->Make(part.Part(0.0, 0.8));
    scan.refined = std::make_unique<Step<RefineBones>>(
        cache_, backend_, RefineBones::Inputs{*bone_template_, scan.scan->artifact(), scan.found->artifact()},
        NoOptions{}, [this, &scan] {
          template_->Load(), bones_->Load(), weights_->Load(), scan.scan->Load(), scan.found->Load();
        });
    scan.refined->Make(part.Part(0.8, 1.0));
    scan.scan->Release();
  }

  void FitJoints() {
    const Progress part = Named(shares_.Next(kJointsCost), "joints");
    const BoneSet& bones = bones_->Load();
    for (ScanSteps& scan : scans_) {
      scan.fits->Load();  // small: stays
      all_fits_.push_back(scan.fits->artifact());
      AddWarnings(BoneWarnings(scan.study.name, bones, scan.fits->Load()));
      AddWarnings(UnusedHintWarnings(scan.study.name, bones, scan.fits->Load(), HintsOf(scan)));
    }
    AddWarnings(TemplateWarnings(bones, all_fits_));
    FitSkeleton::Options options;
    options.region = study_.region;
    options.joints = study_.joints;
    skeleton_ = std::make_unique<Step<FitSkeleton>>(cache_, backend_,
                                                    FitSkeleton::Inputs{bones_->artifact(), all_fits_},
                                                    options, [this] { bones_->Load(); });
    About("joints", [&] { skeleton_->Make(part); });
  }

  void AddWarnings(std::vector<std::string> more) { std::ranges::move(more, std::back_inserter(warnings_)); }

  void WeighBody() {
    const Progress part = Named(shares_.Next(kWeightsCost), "weights");
    body_ = std::make_unique<Step<SegmentBody>>(
        cache_, backend_, SegmentBody::Inputs{template_->artifact(), bones_->artifact()}, NoOptions{},
        [this] { template_->Load(), bones_->Load(); });
    body_->Make(part.Part(0.0, 0.2));
    AddWarnings(BonesOutsideBody(bones_->Load(), body_->Load()));
    AddWarnings(TissueBesideBody(template_->Load().volume, body_->Load()));
    weights_ = std::make_unique<Step<ComputeWeights>>(
        cache_, backend_, ComputeWeights::Inputs{bones_->artifact(), body_->artifact()},
        ComputeWeights::Options{}, [this] { bones_->Load(), body_->Load(); });
    weights_->Make(part.Part(0.2, 0.9));
    region_ = std::make_unique<Step<DilateBody>>(cache_, backend_, DilateBody::Inputs{body_->artifact()},
                                                 DilateBody::Options{}, [this] { body_->Load(); });
    region_->Make(part.Part(0.9, 1.0));
  }

  void RegisterOne(ScanSteps& s) {
    s.registered = std::make_unique<Step<RegisterScan>>(
        cache_, backend_,
        RegisterScan::Inputs{template_->artifact(), body_->artifact(), bones_->artifact(),
                             weights_->artifact(), s.fits->artifact(), s.scan->artifact()},
        RegisterScan::Options{options_.method, PaperOptionsOf(options_)}, [this, &s] {
          template_->Load(), body_->Load(), bones_->Load(), weights_->Load(), s.fits->Load(), s.scan->Load();
        });
    s.registered->Make(Named(shares_.Next(kRegisterCost), "register " + s.study.name));
    MakeExample(s);
    MakeMeasures(s);
    s.registered->Release();
    s.scan->Release();
  }

  void MakeExample(ScanSteps& s) {
    s.example = std::make_unique<Step<ComputeExample>>(
        cache_, backend_,
        ComputeExample::Inputs{body_->artifact(), weights_->artifact(), s.fits->artifact(),
                               s.registered->artifact()},
        NoOptions{}, [this, &s] { body_->Load(), weights_->Load(), s.fits->Load(), s.registered->Load(); });
    const Progress part = Named(shares_.Next(kExamplesCost), "examples");
    s.example->Make(part.Part(0.0, 0.8));
    s.shown = std::make_unique<Step<ShownTissue>>(
        cache_, backend_,
        ShownTissue::Inputs{body_->artifact(), weights_->artifact(), s.fits->artifact(),
                            skeleton_->artifact(), s.registered->artifact(), template_->artifact(),
                            s.scan->artifact()},
        NoOptions{}, [this, &s] {
          body_->Load(), weights_->Load(), s.fits->Load(), skeleton_->Load(), s.registered->Load();
          template_->Load(), s.scan->Load();
        });
    s.shown->Make(part.Part(0.8, 0.9));
    s.samples = std::make_unique<Step<SampleExample>>(
        cache_, backend_,
        SampleExample::Inputs{body_->artifact(), s.example->artifact(), s.shown->artifact()}, NoOptions{},
        [this, &s] { body_->Load(), s.example->Load(), s.shown->Load(); });
    s.samples->Make(part.Part(0.9, 1.0));
    s.example->Release();
    s.shown->Release();
    s.samples->Release();
  }

  // All examples with each other, at some of their voxels.
  void Compare() {
    for (ScanSteps& scan : scans_) samples_.push_back(scan.samples->artifact());
    moments_ = std::make_unique<Step<CompareExamples>>(
        cache_, backend_,
        CompareExamples::Inputs{body_->artifact(), weights_->artifact(), skeleton_->artifact(), samples_},
        CompareExamples::Options{int(bones_->Load().bones.size())}, [this] {
          body_->Load(), weights_->Load(), skeleton_->Load();
          for (size_t k = 0; k < scans_.size(); ++k) {
            scans_[k].samples->Load();
            samples_[k] = scans_[k].samples->artifact();
          }
        });
    moments_->Make({});
  }

  // Examples of scans of which bones are lost.
  void Complete() {
    const Progress part = Named(shares_.Next(kCompleteCost), "examples");
    std::vector<ExampleStack::Scan> scans;
    for (ScanSteps& s : scans_) {
      scans.push_back({s.example->key(), s.shown->key(), [&s] { return s.example->Borrow(); },
                       [&s] { return s.shown->Borrow(); }});
    }
    stack_ = std::make_unique<ExampleStack>(body_->artifact(), std::move(scans));
    const double count = double(scans_.size());
    for (size_t k = 0; k < scans_.size(); ++k) {
      ScanSteps& s = scans_[k];
      const double hidden = HiddenPart(*s.samples->Borrow());
      if (hidden < kLeastHidden) continue;
      warnings_.push_back(HiddenTissueText(s.study.name, hidden));
      s.completed = std::make_unique<Step<CompleteExample>>(
          cache_, backend_,
          CompleteExample::Inputs{*stack_, body_->artifact(), weights_->artifact(), skeleton_->artifact(),
                                  moments_->artifact()},
          CompleteExample::Options{int(k)},
          [this] { body_->Load(), weights_->Load(), skeleton_->Load(), moments_->Load(); });
      s.completed->Make(part.Part(double(k) / count, double(k + 1) / count));
      s.completed->Release();
    }
    stack_->Forget();
  }

  void MakeMeasures(ScanSteps& s) {
    s.measures = std::make_unique<Step<MeasureScan>>(
        cache_, backend_,
        MeasureScan::Inputs{template_->artifact(), region_->artifact(), weights_->artifact(),
                            s.fits->artifact(), s.scan->artifact(), s.registered->artifact()},
        NoOptions{}, [this, &s] {
          template_->Load(), region_->Load(), weights_->Load(), s.fits->Load(), s.scan->Load(),
              s.registered->Load();
        });
    s.measures->Make(Named(shares_.Next(kMeasuresCost), "measures"));
  }

  // One example after the other, and nothing else of that size.
  void CutIntoBricks() {
    template_->Release();
    std::vector<Digest> examples;
    for (const ScanSteps& s : scans_) examples.push_back(ExampleKey(s));
    const auto load_example = [this](size_t k) { return BorrowExample(scans_[k]); };
    bricks_ = std::make_unique<Step<CutBricks>>(
        cache_, backend_,
        CutBricks::Inputs{body_->artifact(), bones_->artifact(), weights_->artifact(), examples,
                          load_example},
        NoOptions{}, [this] { body_->Load(), bones_->Load(), weights_->Load(); });
    bricks_->Make(Named(shares_.Next(kBricksCost), "bricks"));
    bricks_->Release();
  }

  ModelScan ScanEntry(ScanSteps& s) {
    const MeasureScan::Output& measured = s.measures->Load();
    return {s.study.name,       s.scan->key(),     s.fits->key(),           s.registered->key(),
            ExampleKey(s),      measured.by_stage, measured.control_points, measured.folded_fraction,
            measured.confidence};
  }

  std::map<std::string, double> Seconds() const {
    std::map<std::string, double> seconds{
        {"load", template_->Seconds()},
        {"bones", bones_->Seconds() + (segmented_ ? segmented_->Seconds() : 0.0)},
        {"joints", skeleton_->Seconds()},
        {"register_bones", settled_->Seconds()},
        {"body", body_->Seconds() + region_->Seconds()},
        {"weights", weights_->Seconds()},
        {"examples", moments_->Seconds() + bricks_->Seconds()}};
    for (const ScanSteps& s : scans_) AddSeconds(s, seconds);
    double total = 0;
    for (const auto& [stage, spent] : seconds) total += spent;
    seconds["total"] = total;
    return seconds;
  }

  ModelManifest Manifest() {
    ModelManifest manifest;
    manifest.program_version = KVX_VERSION;
    manifest.name = study_.name;
    manifest.region = NameOf(study_.region);
    manifest.template_scan = study_.template_scan;
    manifest.device = backend_.device_name();
    manifest.method = options_.method == RegistrationMethod::kPaper ? "paper" : "adaptive";
    manifest.template_key = template_->key();
    manifest.body = body_->key();
    manifest.bones = bones_->key();
    manifest.weights = weights_->key();
    manifest.skeleton = skeleton_->key();
    manifest.moments = moments_->key();
    manifest.bricks = bricks_->key();
    for (ScanSteps& s : scans_) manifest.scans.push_back(ScanEntry(s));
    manifest.seconds = Seconds();
    manifest.warnings = warnings_;
    return manifest;
  }

  const Study& study_;
  const BuildOptions& options_;
  const StageCache& cache_;
  Backend& backend_;
  ProgressShares shares_;
  std::unique_ptr<LoadStep> template_;
  std::unique_ptr<BoneTemplate> bone_template_;
  std::vector<ScanSteps> scans_;
  std::vector<Artifact<BoneFits>> refined_, all_fits_;
  std::unique_ptr<Step<SegmentBones>> segmented_;  // only of strokes or a threshold
  std::vector<std::string> warnings_;
  std::unique_ptr<Step<BuildBoneSet>> bones_;
  std::unique_ptr<Step<SettleBones>> settled_;
  std::unique_ptr<Step<FitSkeleton>> skeleton_;
  std::unique_ptr<Step<SegmentBody>> body_;
  std::unique_ptr<Step<ComputeWeights>> weights_;
  std::unique_ptr<Step<DilateBody>> region_;
  std::vector<Artifact<SampleExample::Output>> samples_;
  std::unique_ptr<Step<CompareExamples>> moments_;
  std::unique_ptr<ExampleStack> stack_;
  std::unique_ptr<Step<CutBricks>> bricks_;
};

Digest BytesOf(const ModelManifest& manifest, const StageCache& cache) {
  Hasher hasher;
  for (const Digest& key : manifest.Keys()) hasher.Add(cache.BytesDigest(key).value());
  return hasher.Finish();
}

}  // namespace

ModelManifest BuildModel(const Study& study, const BuildOptions& options, const std::filesystem::path& model,
                         const std::filesystem::path& artifacts, Backend& backend, const Progress& progress) {
  options.paper.Validate();
  MakeModelFolder(model);
  const StageCache cache(artifacts.empty() ? model / "artifacts" : artifacts);
  ModelManifest manifest = Build(study, options, cache, backend, progress).Run();
  if (!artifacts.empty()) {
    manifest.artifact_folder =
        std::filesystem::proximate(std::filesystem::absolute(artifacts), std::filesystem::absolute(model))
            .string();
  }
  manifest.artifact_bytes = BytesOf(manifest, cache);
  WriteManifest(model / "model.json", manifest);
  return manifest;
}

}  // namespace kvx
