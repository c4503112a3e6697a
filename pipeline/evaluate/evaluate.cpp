// Distances from the truth per scan, stage, tissue and bone.
#include "pipeline/evaluate/evaluate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/blend_deform.h"
#include "pipeline/model/map_to_scan.h"
#include "pipeline/registration/region/level_field.h"
#include "pipeline/registration/result/confidence.h"

namespace kvx {
namespace {

constexpr double kNearJointMm = 10.0;
constexpr double kNoPoints = std::numeric_limits<double>::quiet_NaN();

class Mean {
 public:
  void Add(double value) { sum_ += value, ++count_; }
  double Value() const { return count_ ? sum_ / double(count_) : kNoPoints; }

 private:
  double sum_ = 0;
  int64_t count_ = 0;
};

double Percentile95(std::vector<double> values) {
  if (values.empty()) return kNoPoints;
  const size_t rank = size_t(0.95 * double(values.size() - 1));  // nineteen of twenty are not larger
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(rank), values.end());
  return values[rank];
}

std::map<std::string, Distances> DistancesByStage(const Model& model, const std::string& scan,
                                                  const TruthPose& pose, const Truth& truth) {
  const TruthPoints points = ReadTruthPoints(pose);
  const auto mapped = [&](ScanStage stage) {
    return MapPointsToScan(model, scan, stage, points.in_template);
  };
  return {{"source", Compare(points, points.in_template, truth.tissues)},
          {"initialise", Compare(points, mapped(ScanStage::kInitialise), truth.tissues)},
          {"register", Compare(points, mapped(ScanStage::kRegister), truth.tissues)}};
}

// The points in voxels of the body where the registration is sure, or those where it is not. Of others, as of
// skin at the border, it says nothing.
TruthPoints Only(bool sure, TruthPoints points, const Mask& confidence_percent, const Mask& body) {
  const Grid& grid = body.grid;
  for (size_t i = 0; i < points.counts.size(); ++i) {
    const Eigen::Vector3i p = grid.ToVox(points.in_template[i]).ijk.array().round().cast<int>();
    const bool stated = grid.Contains(p) && body(p.x(), p.y(), p.z());
    points.counts[i] =
        points.counts[i] && stated && (confidence_percent(p.x(), p.y(), p.z()) >= kUnsurePercent) == sure;
  }
  return points;
}

std::map<std::string, Distances> DistancesByConfidence(const Model& model, size_t k, const TruthPose& pose,
                                                       const Truth& truth) {
  const Artifact<RegisteredScan> registered = model.LoadRegistered(int(k));
  if (registered->place_error_steps.values.empty()) return {};
  const Mask percent = ConfidencePercent(registered->place_error_steps);
  const TruthPoints points = ReadTruthPoints(pose);
  const std::vector<PointMm> mapped =
      MapPointsToScan(model, model.scan_names()[k], ScanStage::kRegister, points.in_template);
  const auto where = [&](bool sure) {
    return Compare(Only(sure, points, percent, model.body()), mapped, truth.tissues);
  };
  return {{"sure", where(true)}, {"unsure", where(false)}};
}

std::vector<BoneError> BoneErrors(const Model& model, size_t scan, const TruthPose& pose,
                                  const Truth& truth) {
  std::vector<BoneError> errors;
  for (size_t j = 0; j < model.bone_names().size(); ++j) {
    const std::string& bone = model.bone_names()[j];
    const auto known = pose.scan_from_template.find(bone);
    const auto centroid = truth.bone_centroids.find(bone);
    if (known == pose.scan_from_template.end() || centroid == truth.bone_centroids.end()) continue;
    errors.push_back(
        Compare(bone, model.scan_fits()[scan][j].scan_from_template, known->second, centroid->second));
  }
  return errors;
}

ScanEvaluation EvaluateScan(Backend& backend, const Model& model, size_t k, const Truth* truth) {
  const ModelScan& scan = model.manifest().scans[k];
  ScanEvaluation out{.name = scan.name,
                     .measures = scan.measures,
                     .control_points = scan.control_points,
                     .control_points_per_level = scan.control_points_per_level,
                     .folded_fraction = scan.folded_fraction,
                     .confidence = model.manifest().ConfidenceOf(scan)};
  const DisplacementField by_bones = BlendField(backend)(model.weights(), PoseOf(model.scan_fits()[k]));
  out.folded_by_stage = {{"source", 0.0},
                         {"initialise", FoldedFraction(by_bones, model.body())},
                         {"register", scan.folded_fraction}};
  if (!truth) return out;
  for (const TruthPose& pose : truth->poses) {
    if (pose.name != scan.name) continue;
    out.distances = DistancesByStage(model, scan.name, pose, *truth);
    out.bone_errors = BoneErrors(model, k, pose, *truth);
    out.by_confidence = DistancesByConfidence(model, k, pose, *truth);
  }
  return out;
}

UnseenEvaluation EvaluateUnseen(const Model& model, const PosingEngine& engine, const TruthPose& pose,
                                const Truth& truth) {
  const TruthPoints points = ReadTruthPoints(pose);
  UnseenEvaluation out;
  out.name = pose.name;
  for (const auto& [mode, name] : kDeformationModes) {
    const ResolvedPose resolved = model.Resolve(BonePose{pose.scan_from_template}, mode);
    if (resolved.extrapolation.size()) out.extrapolation = resolved.extrapolation.maxCoeff();
    out.distances[name] = Compare(points, engine.MapPoints(resolved, points.in_template), truth.tissues);
  }
  return out;
}

std::string Quoted(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "'" : ", '") + name + "'";
  return out;
}

std::vector<std::string> BonesOfTruthAlone(const Truth& truth, const std::vector<std::string>& of_model) {
  std::vector<std::string> out;
  for (const auto& [bone, centroid] : truth.bone_centroids)
    if (std::ranges::find(of_model, bone) == of_model.end()) out.push_back(bone);
  return out;
}

std::vector<std::string> NameWarnings(const std::vector<std::string>& without_truth) {
  if (without_truth.empty()) return {};
  return {"the truth has no pose of the name of " + Quoted(without_truth) +
          ", so their distances are not known, nor which poses the model has not seen; name the scans of a "
          "study as the files of its phantom ('pose01' for pose01.nii.gz)"};
}

}  // namespace

Distances Compare(const TruthPoints& truth, const std::vector<PointMm>& mapped,
                  const std::vector<std::string>& tissues) {
  Mean all, soft, joint;
  std::map<std::string, Mean> tissue;
  std::vector<double> distances;
  Distances out;
  int64_t lost = 0;
  for (size_t i = 0; i < mapped.size(); ++i) {
    if (!truth.counts[i]) continue;
    const double distance = (mapped[i].lps - truth.in_scan[i].lps).norm();
    if (!std::isfinite(distance)) {
      ++lost;
      continue;
    }
    distances.push_back(distance);
    all.Add(distance);
    if (truth.tissue[i] < tissues.size()) tissue[tissues[truth.tissue[i]]].Add(distance);
    if (truth.bone[i] != 0) continue;
    soft.Add(distance);
    if (truth.joint_distance_mm[i] < kNearJointMm) joint.Add(distance);
  }
  out.points = int64_t(distances.size());
  if (out.points + lost > 0) out.lost_fraction = double(lost) / double(out.points + lost);
  out.all = all.Value(), out.soft = soft.Value(), out.joint = joint.Value();
  for (const auto& [name, mean] : tissue) out.by_tissue[name] = mean.Value();
  out.max = distances.empty() ? kNoPoints : *std::max_element(distances.begin(), distances.end());
  out.p95 = Percentile95(std::move(distances));
  return out;
}

BoneError Compare(const std::string& bone, const RigidTransform& found, const RigidTransform& truth,
                  const PointMm& centroid) {
  const RigidTransform between{found.rotation.conjugate() * truth.rotation, Eigen::Vector3d::Zero()};
  return {bone, DegFromRad(between.AngleRad()), ((found * centroid).lps - (truth * centroid).lps).norm()};
}

Evaluation Evaluate(Backend& backend, const Model& model, const PosingEngine* engine, const Truth* truth,
                    const Progress& progress) {
  Evaluation out;
  out.seconds = model.manifest().seconds;
  MatchedNames names;
  if (truth) names = MatchNames(*truth, model.manifest().template_scan, model.scan_names());
  out.warnings = NameWarnings(names.without_truth);
  const std::vector<std::string> alone =
      truth ? BonesOfTruthAlone(*truth, model.bone_names()) : std::vector<std::string>();
  if (!alone.empty() && !names.unseen.empty()) {
    names.unseen.clear();
    out.warnings.push_back("the model has no bone of the truth's names " + Quoted(alone) +
                           ", so it is not asked for poses that it has not seen");
  }
  const size_t scans = model.scan_names().size(), poses = engine ? names.unseen.size() : 0;
  for (size_t k = 0; k < scans; ++k) {
    progress.Report("scans", double(k) / double(scans + poses));
    out.scans.push_back(EvaluateScan(backend, model, k, truth));
  }
  for (size_t p = 0; p < poses; ++p) {
    progress.Report("unseen poses", double(scans + p) / double(scans + poses));
    out.unseen.push_back(EvaluateUnseen(model, *engine, truth->poses[names.unseen[p]], *truth));
  }
  return out;
}

}  // namespace kvx
