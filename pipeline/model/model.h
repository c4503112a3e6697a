// A built model: the manifest that names its artefacts, and the artefacts loaded for posing.
#pragma once
#include <memory>
#include <mutex>
#include <optional>

#include "core/study.h"
#include "pipeline/examples/pose_space.h"
#include "pipeline/model/files/manifest.h"
#include "pipeline/posing/posing_engine.h"
#include "pipeline/registration/result/bordered_field.h"

namespace kvx {

class PoseEquilibrium;

class Model {
 public:
  // `model`: a folder that BuildModel made. `artifacts`: empty for where the manifest says.
  // Throws NotFound when an artefact is gone.
  static Model Load(const std::filesystem::path& model, const std::filesystem::path& artifacts = {});

  const ModelManifest& manifest() const { return manifest_; }
  const Scan& template_scan() const { return *template_scan_; }
  const BoneSet& bones() const { return *bones_; }
  const SkeletonFit& fit() const { return *fit_; }
  const WeightMap& weights() const;  // loaded when first asked for; throws NotFound
  const Mask& body() const { return *body_; }
  const std::vector<BoneFits>& scan_fits() const { return scan_fits_; }
  const std::vector<std::string>& bone_names() const { return bone_names_; }
  const std::vector<std::string>& scan_names() const { return scan_names_; }

  ResolvedPose Resolve(const PoseRequest& request, DeformationMode mode) const;
  PoseResolver Resolver() const;  // refers to this model
  const ExampleMoments& moments() const { return moments_; }
  const PoseSpace& space() const { return space_; }
  const PoseSpaceOptions& space_options() const { return space_options_; }
  void UsePoseSpace(const PoseSpaceOptions& options) {
    space_options_ = options;
    space_ = PoseSpace(*fit_, options, moments_);
  }
  // Loads the bricks, or else weights and examples; keep the engine for further poses.
  std::unique_ptr<PosingEngine> MakeEngine(Backend& backend,
                                           double most_voxels = PosingEngine::kMostVoxels) const;
  Artifact<RegisteredScan> LoadRegistered(int scan) const;
  Artifact<Scan> LoadScanVolume(int scan) const;
  Artifact<DisplacementField> LoadExample(int scan) const;

 private:
  Model() = default;
  std::shared_ptr<const BrickedBody> Bricks() const;
  PoseVector PoseAsShown(int scan) const;
  std::unique_ptr<const PoseEquilibrium> Equilibrium(Backend& backend, const BrickedBody& bricked) const;
  ElasticAddition ElasticAdditionOf(Backend& backend, std::shared_ptr<const BrickedBody> bricked) const;
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
  PoseSpaceOptions space_options_;
  PoseSpace space_;
  BoneResiduals residuals_;
};

// Among scan_names(); throws NotFound, which says what there is.
int ScanIndex(const Model& model, const std::string& scan);
// What a registered scan says of points; refers to the field and the model's bones.
BorderedField Bordered(const Model& model, int scan, const DisplacementField& scan_from_template);

}  // namespace kvx
