// The stage graph of a model (docs/architecture.md), run in order; voxels are held for the template, for the
// first scan until it is registered, and for one scan more.
#include "pipeline/model/build/build_model.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "core/host/free_memory.h"
#include "core/host/parallel.h"
#include "core/region_presets.h"
#include "pipeline/artifacts/leftovers.h"
#include "pipeline/io/mask_folder.h"
#include "pipeline/io/segment_names.h"
#include "pipeline/model/build/progress_shares.h"
#include "pipeline/model/build/study_wiring.h"
#include "pipeline/model/files/model_folder.h"
#include "pipeline/model/warnings/bent_template.h"
#include "pipeline/model/warnings/bone_warnings.h"
#include "pipeline/model/warnings/joint_warnings.h"
#include "pipeline/model/warnings/study_warnings.h"
#include "pipeline/scans/grey_kind.h"
#include "pipeline/skeleton/joint_plan.h"

namespace kvx {
namespace {

// Expected cost of the stages, for progress only; register and register_bones are per scan.
constexpr double kLoadCost = 1, kBonesCost = 2, kFoundCost = 6.4, kRefinedCost = 1.6, kJointsCost = 1,
                 kWeightsCost = 8, kRegisterCost = 30, kExamplesCost = 2, kMeasuresCost = 2,
                 kCompleteCost = 2, kBricksCost = 1;
constexpr double kLeastHidden = 0.002;  // of the body, from which on a scan's example is completed

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

// What a time limit leaves depends on the machine: it has a key of its own and is never found again.
PaperOptions PaperOptionsOf(const BuildOptions& options) {
  PaperOptions paper = options.paper;
  if (paper.max_seconds > 0) paper.run = std::chrono::system_clock::now().time_since_epoch().count();
  return paper;
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
    RequireNamedBones();
    wiring_.WireRest({options_.method, PaperOptionsOf(options_)});
    WeighBodyAndFind();
    PlaceBones();
    FitJoints();
    for (ScanSteps& scan : steps_.scans) RegisterOne(scan);
    steps_.moments->Make({});  // all examples with each other, at some of their voxels
    Complete();
    CutIntoBricks();
    if (options_.method == RegistrationMethod::kPaper) AddWarnings(LimitWarnings(options_.paper));
    return Manifest();
  }

 private:
  static double TotalCost(size_t scans) {  // the template among them
    const double registered = scans > 0 ? double(scans - 1) : 0.0;
    return double(scans) * kLoadCost + kBonesCost + kJointsCost + kWeightsCost + kCompleteCost + kBricksCost +
           registered * (kFoundCost + kRefinedCost + kRegisterCost + kExamplesCost + kMeasuresCost);
  }

  bool Segments() const { return !study_.bone_seeds.empty() || study_.bones_by_threshold; }

  void LoadScans() {
    std::vector<std::pair<std::string, Digest>> files;
    std::vector<std::pair<std::string, bool>> in_hounsfield;
    TwoLoaded two;
    for (size_t k = 0; k < study_.scans.size(); ++k) {
      if (k % 2 == 0) two = LoadTwo(k);
      const StudyScan& scan = study_.scans[k];
      auto step = std::move(two[k % 2]);
      const Scan& loaded = step->Load();
      AddWarnings(ScanWarnings("scan '" + scan.name + "'", loaded));
      in_hounsfield.emplace_back(scan.name, IsHounsfield(loaded.volume, loaded.modality));
      files.emplace_back(scan.name, step->key());
      if (scan.name == study_.template_scan) {
        steps_.template_scan = std::move(step);
        continue;
      }
      const bool next = steps_.scans.empty() && !Segments();  // asked for soon, and little else is there
      if (!next) step->Release();
      steps_.scans.push_back({.study = scan, .scan = std::move(step)});
    }
    if (!steps_.template_scan)
      throw InputError("the study's template is not one of its scans; name one of them in \"template\"");
    AddWarnings(SameScanWarnings(files));
    AddWarnings(ModalityWarnings(in_hounsfield));
    AddWarnings(UnreadFieldWarnings(study_.unread_fields));
    AddWarnings(TemplatePoseWarnings(study_));
  }

  // The k-th scan and the next, side by side: most of it is work for one thread.
  using TwoLoaded = std::array<std::unique_ptr<Step<LoadScan>>, 2>;
  TwoLoaded LoadTwo(size_t k) {
    TwoLoaded two;
    const auto load = [&](size_t n, const Progress& progress) {
      const StudyScan& scan = study_.scans[k + n];
      About("scan '" + scan.name + "'", [&] {
        two[n] = wiring_.Loaded(scan);
        two[n]->Make(progress);
      });
    };
    const Progress first = Named(shares_.Next(kLoadCost), "load");
    first.Report("load", 0.0);
    if (k + 1 == study_.scans.size())
      load(0, first);
    else
      SideBySide([&] { load(0, first); },
                 [&, second = shares_.Next(kLoadCost)] { load(1, second.Silent()); });
    return two;
  }

  void FindBones() {
    const bool segment = Segments();
    if (study_.bone_labels.empty() && !segment) {
      throw InputError(
          "the study names no bone labels; give a label map on the template in \"bones\": {\"labels\": ...}");
    }
    const Progress part = Named(shares_.Next(kBonesCost), "bones");
    About("bones", [&] {
      if (segment) {
        ReturnFreeMemory();
        steps_.segmented = wiring_.Segmented();
        steps_.segmented->Make(part.Part(0.0, 0.8));
      }
      steps_.bones = wiring_.Bones();
      steps_.bones->Make(part.Part(segment ? 0.8 : 0.0, 1.0));
      if (steps_.segmented) {
        AddWarnings(WarningsOf(steps_.segmented->Load(), steps_.bones->Load().NamesByLabel()));
      } else {
        AddWarnings(LabelWarnings(steps_.bones->Load()));
        if (!HoldsMasks(study_.bone_labels, study_.bones))
          AddWarnings(
              SegmentNameWarnings(steps_.bones->Load(), ReadSegmentNames(study_.bone_labels), study_.region));
        AddWarnings(MisplacedLabelWarnings(steps_.template_scan->Load().volume, steps_.bones->Load().labels));
      }
      AddWarnings(NameWarnings(steps_.bones->Load(), study_.region));
      AddWarnings(MissingBoneWarnings(steps_.bones->Load(), study_.region));
      AddWarnings(ParentWarnings(steps_.bones->Load(), study_.region));
      if (steps_.segmented) steps_.segmented->Release();
    });
  }

  void RequireNamedBones() {  // before the long work
    const BoneSet& bones = steps_.bones->Load();
    About("joints", [&] { PlanJoints(bones, study_.region, study_.joints); });
    About("initial_poses", [&] {
      for (const auto& [scan, poses] : study_.initial_poses)
        for (const auto& [bone, pose] : poses) bones.IndexOf(bone);
    });
  }

  // The body's weights, and beside them the bones of the first scan: neither needs the other.
  void WeighBodyAndFind() {
    const Progress weighing = Named(shares_.Next(kWeightsCost), "weights");
    if (steps_.scans.empty()) return WeighBody(weighing);
    weighing.Report("weights", 0.0);
    const Progress finding = FindingProgress(steps_.scans.front());
    SideBySide([&] { steps_.scans.front().found->Make(finding); }, [&] { WeighBody(weighing.Silent()); });
  }

  // The first scan's were found beside the weights.
  void PlaceBones() {
    for (size_t k = 0; k < steps_.scans.size(); ++k) {
      ScanSteps& scan = steps_.scans[k];
      if (k > 0) scan.found->Make(FindingProgress(scan));
      scan.refined->Make(Named(shares_.Next(kRefinedCost), "register_bones " + scan.study.name));
      if (k > 0) scan.scan->Release();  // the first is registered first
    }
    steps_.bone_template->Forget();
    About("joints", [&] { steps_.settled->Make({}); });
    for (ScanSteps& scan : steps_.scans) scan.fits->Make({});
  }

  std::vector<std::string> ScanNames() const {
    std::vector<std::string> names;
    for (const ScanSteps& scan : steps_.scans) names.push_back(scan.study.name);
    return names;
  }

  Progress FindingProgress(const ScanSteps& scan) {
    return Named(shares_.Next(kFoundCost), "register_bones " + scan.study.name);
  }

  void FitJoints() {
    const Progress part = Named(shares_.Next(kJointsCost), "joints");
    const BoneSet& bones = steps_.bones->Load();
    std::vector<BoneFits> fits;
    for (ScanSteps& scan : steps_.scans) {
      fits.push_back(scan.fits->Load());  // small: stays
      AddWarnings(BoneWarnings(scan.study.name, bones, fits.back()));
      AddWarnings(UnusedHintWarnings(scan.study.name, bones, fits.back(), HintsOf(study_, scan.study)));
    }
    AddWarnings(TemplateWarnings(bones, fits));
    About("joints", [&] { steps_.skeleton->Make(part); });
    const auto fit = steps_.skeleton->Borrow();
    const std::vector<JointPlan> plans = PlanJoints(bones, study_.region, study_.joints);
    AddWarnings(
        StillJointWarnings(bones, plans, fit->skeleton, FitSkeleton::Options{}.limit_margin_rad, fits));
    AddWarnings(StrayingJointWarnings(bones, plans, *fit, fits));
    AddWarnings(BentTemplateWarnings(study_.template_scan, bones, fit->skeleton, ScanNames(), fits));
  }

  void AddWarnings(std::vector<std::string> more) { std::ranges::move(more, std::back_inserter(warnings_)); }

  void WeighBody(const Progress& progress) {
    steps_.body->Make(progress.Part(0.0, 0.2));
    AddWarnings(NoAirWarnings(steps_.body->Load()));
    AddWarnings(BonesOutsideBody(steps_.bones->Load(), steps_.body->Load()));
    AddWarnings(TissueBesideBody(steps_.template_scan->Load().volume, steps_.body->Load()));
    steps_.weights->Make(progress.Part(0.2, 0.9));
    steps_.region->Make(progress.Part(0.9, 1.0));
  }

  void RegisterOne(ScanSteps& s) {
    s.registered->Make(Named(shares_.Next(kRegisterCost), "register " + s.study.name));
    ReturnFreeMemory();  // nothing leaves as much in pieces as this
    const Progress example = Named(shares_.Next(kExamplesCost), "examples"),
                   measures = Named(shares_.Next(kMeasuresCost), "measures");
    SideBySide([&] { MakeExample(s, example); }, [&] { s.measures->Make(measures.Silent()); });
    measures.Report("measures", 1.0);
    const auto measured = s.measures->Borrow();
    AddWarnings(LessAlikeWarnings(s.study.name, measured->by_stage));
    if (options_.method != RegistrationMethod::kPaper)  // which states no confidence
      AddWarnings(UnsureTissueWarnings(s.study.name, measured->confidence.unsure_fraction));
    s.registered->Release();
    s.scan->Release();
  }

  void MakeExample(ScanSteps& s, const Progress& progress) {
    s.example->Make(progress.Part(0.0, 0.8));
    s.shown->Make(progress.Part(0.8, 0.9));
    s.samples->Make(progress.Part(0.9, 1.0));
    s.example->Release();
    s.shown->Release();
    s.samples->Release();
  }

  // Examples of scans of which bones are lost.
  void Complete() {
    const Progress part = Named(shares_.Next(kCompleteCost), "examples");
    const double count = double(steps_.scans.size());
    for (size_t k = 0; k < steps_.scans.size(); ++k) {
      ScanSteps& s = steps_.scans[k];
      const double hidden = HiddenPart(*s.samples->Borrow());
      if (hidden < kLeastHidden) continue;
      warnings_.push_back(HiddenTissueText(s.study.name, hidden));
      s.completed = wiring_.Completed(int(k));
      s.completed->Make(part.Part(double(k) / count, double(k + 1) / count));
      s.completed->Release();
    }
    steps_.stack->Forget();
  }

  // One example after the other, and nothing else of that size.
  void CutIntoBricks() {
    steps_.template_scan->Release();
    steps_.bricks = wiring_.Bricks();
    steps_.bricks->Make(Named(shares_.Next(kBricksCost), "bricks"));
    steps_.bricks->Release();
  }

  ModelManifest Manifest() {
    ModelManifest manifest = ManifestOf(steps_);
    manifest.name = study_.name;
    manifest.region = NameOf(study_.region);
    manifest.template_scan = study_.template_scan;
    manifest.device = backend_.device_name();
    manifest.method = options_.method == RegistrationMethod::kPaper ? "paper" : "adaptive";
    manifest.warnings = warnings_;
    return manifest;
  }

  const Study& study_;
  const BuildOptions& options_;
  const StageCache& cache_;
  Backend& backend_;
  ProgressShares shares_;
  StudySteps steps_;
  const StudyWiring wiring_{cache_, backend_, study_, steps_};
  std::vector<std::string> warnings_;
};

Digest BytesOf(const ModelManifest& manifest, const StageCache& cache) {
  Hasher hasher;
  for (const Digest& key : manifest.Keys()) hasher.Add(cache.BytesDigest(key).value());
  return hasher.Finish();
}

// As seen from the model's, in which they are where no other is given.
std::string ArtifactFolder(const std::filesystem::path& model, const std::filesystem::path& artifacts) {
  if (artifacts.empty()) return "artifacts";
  const std::string seen =
      std::filesystem::proximate(std::filesystem::absolute(artifacts), std::filesystem::absolute(model))
          .string();
  RequireUtf8(seen);
  return seen;
}

}  // namespace

ModelManifest BuildModel(const Study& study, const BuildOptions& options, const std::filesystem::path& model,
                         const std::filesystem::path& artifacts, Backend& backend, const Progress& progress) {
  options.paper.Validate();
  const std::string artifact_folder = ArtifactFolder(model, artifacts);
  MakeModelFolder(model, artifact_folder);
  const StageCache cache(artifacts.empty() ? model / "artifacts" : artifacts);
  RemoveLeftovers(cache.folder());
  ModelManifest manifest = Build(study, options, cache, backend, progress).Run();
  manifest.artifact_folder = artifact_folder;
  manifest.artifact_bytes = BytesOf(manifest, cache);
  WriteManifest(model / "model.json", manifest);
  ReturnFreeMemory();
  return manifest;
}

}  // namespace kvx
