// A built model: the manifest that names its artefacts, and the artefacts loaded for posing.
#pragma once
#include <memory>
#include <mutex>
#include <optional>

#include "core/study.h"
#include "pipeline/examples/pose_space.h"
#include "pipeline/posing/posing_engine.h"
#include "pipeline/registration/register_scan.h"
#include "pipeline/registration/result/bordered_field.h"

namespace kvx {

struct ModelScan {
  std::string name;
  Digest scan, fits, registered, example;    // artefact keys
  std::map<std::string, Measures> measures;  // "source", "initialise", "register"
  int64_t control_points = 0;
  double folded_fraction = 0;
  ConfidenceSummary confidence;
};

// model.json inside MODEL. Artefacts lie in MODEL/artifacts,
// or in a folder shared by many models (the service): the manifest says where.
struct ModelManifest {
  std::string program_version, name, region, template_scan, device, method;
  Digest template_key, body, bones, weights, skeleton;
  std::optional<Digest> moments;              // how alike the examples are; models of old have none
  std::optional<Digest> bricks;               // none in models of other versions: cut when they are loaded
  std::vector<ModelScan> scans;               // training scans, template excluded
  std::map<std::string, double> seconds;      // by stage, and "total"
  std::vector<std::string> warnings;          // of the segmentation: what is doubtful and what to do
  std::string artifact_folder = "artifacts";  // relative to the model's folder
  Digest artifact_bytes;                      // of all artefacts as stored, in the order of Keys()
  std::vector<Digest> Keys() const;           // of all artefacts
  Digest ContentDigest() const;               // of keys and bytes: two builds made the same when this agrees
};

void WriteManifest(const std::filesystem::path& file,
                   const ModelManifest& manifest);              // temporary name, fsync, rename
constexpr const char* kModelKind = "kinevox-model";             // of its document
ModelManifest ReadManifest(const std::filesystem::path& file);  // throws NotFound, InputError

class Model {
 public:
  // `model`: a folder that BuildModel made. `artifacts`: empty for where the manifest says.
  // Throws NotFound when an artefact is gone.
  static Model Load(const std::filesystem::path& model, const std::filesystem::path& artifacts = {});

  const ModelManifest& manifest() const { return manifest_; }
  const Scan& template_scan() const { return *template_scan_; }
  const BoneSet& bones() const { return *bones_; }
  const SkeletonFit& fit() const { return *fit_; }
  const WeightMap& weights() const;  // loaded when first asked for: poses do without; throws NotFound
  const Mask& body() const { return *body_; }
  const std::vector<BoneFits>& scan_fits() const { return scan_fits_; }
  const std::vector<std::string>& bone_names() const { return bone_names_; }
  const std::vector<std::string>& scan_names() const { return scan_names_; }

  ResolvedPose Resolve(const PoseRequest& request, DeformationMode mode) const;
  PoseResolver Resolver() const;  // refers to this model
  const ExampleMoments& moments() const { return moments_; }
  const PoseSpace& space() const { return space_; }
  void UsePoseSpace(const PoseSpaceOptions& options) { space_ = PoseSpace(*fit_, options, moments_); }
  // Loads the bricks, or else weights and examples; keep the engine for further poses.
  std::unique_ptr<PosingEngine> MakeEngine(Backend& backend,
                                           double most_voxels = PosingEngine::kMostVoxels) const;
  Artifact<RegisteredScan> LoadRegistered(int scan) const;
  Artifact<Scan> LoadScanVolume(int scan) const;
  Artifact<DisplacementField> LoadExample(int scan) const;

 private:
  Model() = default;
  ModelManifest manifest_;
  std::shared_ptr<StageCache> cache_;
  std::shared_ptr<const Scan> template_scan_;
  std::shared_ptr<const BoneSet> bones_;
  std::shared_ptr<const SkeletonFit> fit_;
  struct Late {
    std::once_flag once;
    std::shared_ptr<const WeightMap> weights;
  };
  std::shared_ptr<Late> late_ = std::make_shared<Late>();
  std::shared_ptr<const Mask> body_;
  std::vector<BoneFits> scan_fits_;
  std::vector<PoseVector> scan_poses_;
  std::vector<std::string> bone_names_, scan_names_;
  ExampleMoments moments_;
  PoseSpace space_;
};

// Among scan_names(); throws NotFound, which says what there is.
int ScanIndex(const Model& model, const std::string& scan);
// What a registered scan says of points; refers to the field and the model's bones.
BorderedField Bordered(const Model& model, int scan, const DisplacementField& scan_from_template);

// The scan's registered correspondence at template points (map-points --scan):
// stage initialise = VBD, register = Algorithm 1.
enum class ScanStage { kInitialise, kRegister };
std::vector<PointMm> MapPointsToScan(const Model& model, const std::string& scan, ScanStage stage,
                                     const std::vector<PointMm>& in_template);

// The other way: template points of what a scan shows. Not a number where no tissue of the template comes to.
std::vector<PointMm> MapPointsFromScan(const Model& model, const std::string& scan,
                                       const std::vector<PointMm>& in_scan);
// On the template's grid: scan point = x + u(x); says something in the body only.
DisplacementField ScanFromTemplate(const Model& model, const std::string& scan);
// On the scan's grid: template point = x + u(x), as above.
DisplacementField TemplateFromScan(const Model& model, const std::string& scan,
                                   const Progress& progress = {});
// Per cent, on the template's grid. Throws NotFound when the model's method states none.
Volume ConfidenceOf(const Model& model, const std::string& scan);
// In mm, as above: see SurenessMaps. Not a number where it is not known.
Volume PlaceErrorOf(const Model& model, const std::string& scan);

}  // namespace kvx
