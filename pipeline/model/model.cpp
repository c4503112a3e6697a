// Loading a model's artefacts; posing by name, angle or scan.
#include "pipeline/model/model.h"

#include <algorithm>

#include "core/text/listed.h"
#include "pipeline/model/fitting_parts.h"
#include "pipeline/model/pose_equilibrium.h"
#include "pipeline/posing/brick_body.h"
#include "pipeline/posing/cut_bricks.h"
#include "pipeline/posing/without_scan.h"

namespace kvx {
namespace {

const char kDamaged[] =
    "a part of the model is missing or damaged; build it again ('kinevox build', or ask the service for the "
    "same model anew): only what is missing is made";

template <class T>
Artifact<T> Require(const StageCache& cache, const Digest& key) {
  auto found = FindArtifact<T>(cache, key);
  if (!found) throw NotFound(kDamaged);
  return *std::move(found);
}

// Bones x scans: of which scans' displacements one scan's is made near every bone. Its own, but where it
// shows nothing those that lead to expect it, as in its example (examples/expected_example.h).
Eigen::MatrixXf KnownFrom(const PoseSpace& space, const ExampleMoments& moments, size_t bones, int scan,
                          int scans) {
  Eigen::MatrixXf out = Eigen::MatrixXf::Zero(Eigen::Index(bones), scans);
  out.col(scan).setOnes();
  for (size_t bone = 0; bone < bones; ++bone) {
    if (!moments.Hides(bone, scan)) continue;
    const Eigen::VectorXd known = moments.KnownNear(bone, scans);
    out.row(Eigen::Index(bone)) = space.CoefficientsOfOthers(int(bone), scan, known).cast<float>();
  }
  return out;
}

void RequireFitting(bool they_fit) {
  if (!they_fit) throw NotFound(kDamaged);
}

}  // namespace

Model Model::Load(const std::filesystem::path& model, const std::filesystem::path& artifacts) {
  Model out;
  out.manifest_ = ReadManifest(model / "model.json");
  out.cache_ =
      std::make_shared<StageCache>(artifacts.empty() ? model / out.manifest_.artifact_folder : artifacts);
  out.template_scan_ = Require<Scan>(*out.cache_, out.manifest_.template_key).value;
  out.bones_ = Require<BoneSet>(*out.cache_, out.manifest_.bones).value;
  out.fit_ = Require<SkeletonFit>(*out.cache_, out.manifest_.skeleton).value;
  out.body_ = Require<Mask>(*out.cache_, out.manifest_.body).value;
  for (const Bone& bone : out.bones_->bones) out.bone_names_.push_back(bone.name);
  for (const ModelScan& scan : out.manifest_.scans) {
    out.scan_names_.push_back(scan.name);
    out.scan_fits_.push_back(*Require<BoneFits>(*out.cache_, scan.fits));
    out.scan_poses_.push_back(PoseOf(out.scan_fits_.back()));
  }
  if (out.manifest_.moments) out.moments_ = *Require<ExampleMoments>(*out.cache_, *out.manifest_.moments);
  RequireFitting(GoTogether(
      {out.template_scan_->volume.grid, *out.bones_, *out.fit_, *out.body_, out.scan_fits_, out.moments_}));
  out.UsePoseSpace({});
  out.residuals_ = BoneResiduals(*out.fit_, out.moments_);
  return out;
}

const WeightMap& Model::weights() const {
  std::call_once(late_->once, [this] {
    const auto weights = Require<WeightMap>(*cache_, manifest_.weights).value;
    RequireFitting(GoWith(*bones_, *weights));
    late_->weights = weights;
  });
  return *late_->weights;
}

PoseResolver Model::Resolver() const {
  return {bone_names_, scan_names_, manifest_.template_scan, *fit_, scan_poses_, space_, residuals_};
}

ResolvedPose Model::Resolve(const PoseRequest& request, DeformationMode mode) const {
  return Resolver().Resolve(request, mode);
}

std::shared_ptr<const BrickedBody> Model::Bricks() const {
  if (manifest_.bricks) {
    const auto bricks = FindArtifact<BrickedBody>(*cache_, *manifest_.bricks);
    if (bricks && GoWith(*bones_, **bricks, scan_names_.size())) return bricks->value;
  }
  std::vector<Artifact<DisplacementField>> examples;
  PosingInputs inputs{*template_scan_, *body_, *bones_, weights(), {}};
  for (int k = 0; k < int(scan_names_.size()); ++k) {
    examples.push_back(LoadExample(k));
    inputs.examples.push_back(examples.back().value.get());
  }
  return std::make_shared<const BrickedBody>(BrickBody(inputs));
}

// Bones that the scan does not show follow their parents, a root the first bone that it shows: where it says
// that they are means nothing.
PoseVector Model::PoseAsShown(int scan) const {
  PoseVector pose = scan_poses_[size_t(scan)];
  size_t shown = 0;
  while (shown < pose.size() && moments_.Hides(shown, scan)) ++shown;
  const RigidTransform of_root = shown < pose.size() ? pose[shown] : RigidTransform{};
  for (size_t bone = 0; bone < pose.size(); ++bone) {  // parents come first
    const int parent = fit_->skeleton.joints[bone].parent;
    if (moments_.Hides(bone, scan)) pose[bone] = parent == kNoParent ? of_root : pose[size_t(parent)];
  }
  return pose;
}

std::unique_ptr<const PoseEquilibrium> Model::Equilibrium(Backend& backend,
                                                          const BrickedBody& bricked) const {
  const auto weights = Require<WeightMap>(*cache_, manifest_.weights).value;  // let go again: they are large
  RequireFitting(GoWith(*bones_, *weights));
  std::vector<PoseVector> poses;
  std::vector<Eigen::MatrixXf> known_from, without_scan;
  for (int k = 0; k < int(scan_names_.size()); ++k) {
    poses.push_back(PoseAsShown(k));
    known_from.push_back(KnownFrom(space_, moments_, bone_names_.size(), k, int(scan_names_.size())));
    without_scan.push_back(ResolveWithout(Resolver(), space_options_, moments_, k).coefficients);
  }
  return std::make_unique<const PoseEquilibrium>(
      EquilibriumInputs{*body_, bones_->labels, *weights, bricked, poses, known_from, without_scan, moments_},
      backend);
}

// Made at the first pose that is elastic.
ElasticAddition Model::ElasticAdditionOf(Backend& backend, std::shared_ptr<const BrickedBody> bricked) const {
  struct Made {
    std::once_flag once;
    std::unique_ptr<const PoseEquilibrium> equilibrium;
  };
  return [made = std::make_shared<Made>(), model = std::make_shared<const Model>(*this), &backend,
          bricked = std::move(bricked)](const ResolvedPose& pose) {
    std::call_once(made->once, [&] { made->equilibrium = model->Equilibrium(backend, *bricked); });
    return made->equilibrium->BeyondExamples(pose);
  };
}

std::unique_ptr<PosingEngine> Model::MakeEngine(Backend& backend, double most_voxels) const {
  const std::shared_ptr<const BrickedBody> bricked = Bricks();
  return std::make_unique<PosingEngine>(backend, *template_scan_, bones_->labels, bricked,
                                        ElasticAdditionOf(backend, bricked), most_voxels);
}

Artifact<RegisteredScan> Model::LoadRegistered(int scan) const {
  auto found = Require<RegisteredScan>(*cache_, manifest_.scans.at(size_t(scan)).registered);
  const Mask& steps = found->place_error_steps;
  RequireFitting(found->scan_from_template.grid == body_->grid &&
                 (steps.values.empty() || steps.grid == body_->grid));
  return found;
}

Artifact<Scan> Model::LoadScanVolume(int scan) const {
  return Require<Scan>(*cache_, manifest_.scans.at(size_t(scan)).scan);
}

Artifact<DisplacementField> Model::LoadExample(int scan) const {
  auto found = Require<DisplacementField>(*cache_, manifest_.scans.at(size_t(scan)).example);
  RequireFitting(found->grid == body_->grid);
  return found;
}

BorderedField Bordered(const Model& model, int scan, const DisplacementField& scan_from_template) {
  return {scan_from_template, model.bones(), PoseOf(model.scan_fits()[size_t(scan)])};
}

int ScanIndex(const Model& model, const std::string& scan) {
  const auto& names = model.scan_names();
  const auto found = std::find(names.begin(), names.end(), scan);
  if (found != names.end()) return int(found - names.begin());
  const std::string known = Listed(names);
  if (scan == model.manifest().template_scan)
    throw NotFound("'" + scan + "' is the template, which is not registered to anything; name one of " +
                   known);
  throw NotFound("the model has no registered scan '" + scan + "'; it has " + known);
}

}  // namespace kvx
