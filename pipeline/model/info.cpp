// The document of `kinevox info --json` (contract), with digest, method and doubtful bones beside it.
#include "pipeline/model/info.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/joint_values.h"
#include "pipeline/measures/measures_json.h"
#include "pipeline/model/scan_verdict.h"
#include "pipeline/skeleton/bone_certainty.h"

namespace kvx {
namespace {

using Json = nlohmann::ordered_json;

Json ToJson(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }
Json RowMajorJson(const Eigen::Matrix3d& m) {
  Json out = Json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out.push_back(m(row, column));
  }
  return out;
}

Json VolumeJson(const Grid& grid) {
  return {{"size", Json::array({grid.size.x(), grid.size.y(), grid.size.z()})},
          {"spacing", ToJson(grid.spacing_mm)},
          {"origin", ToJson(grid.origin.lps)},
          {"direction", RowMajorJson(grid.direction)}};
}

Json BonesJson(const Model& model) {
  Json out = Json::array();
  for (const Bone& bone : model.bones().bones) {
    Json parent = nullptr;
    if (bone.parent != kNoParent) parent = model.bone_names()[size_t(bone.parent)];
    out.push_back({{"label", bone.label},
                   {"name", bone.name},
                   {"parent", parent},
                   {"voxels", bone.voxels},
                   {"centroid", ToJson(bone.centroid.lps)},
                   {"obb",
                    {{"origin", ToJson(bone.box.origin.lps)},
                     {"axes", RowMajorJson(bone.box.axes)},
                     {"extent_mm", ToJson(bone.box.extent_mm)}}}});
  }
  return out;
}

// `axis_within_rad`: not finite where it is not known.
Json DofJson(const DegreeOfFreedom& dof, bool shift, double axis_within_rad) {
  const ScannedRange scanned = ScannedRangeOf(dof, shift);
  return {{"name", dof.name},
          {"axis_within_deg", std::isfinite(axis_within_rad) ? Json(DegFromRad(axis_within_rad)) : Json()},
          {"axis", ToJson(dof.axis)},
          {shift ? "min_mm" : "min_deg", shift ? ShiftMm(dof.min_rad) : DegFromRad(dof.min_rad)},
          {shift ? "max_mm" : "max_deg", shift ? ShiftMm(dof.max_rad) : DegFromRad(dof.max_rad)},
          {shift ? "scanned_min_mm" : "scanned_min_deg", DegFromRad(scanned.min_rad)},
          {shift ? "scanned_max_mm" : "scanned_max_deg", DegFromRad(scanned.max_rad)}};
}

// Root mean square over the scans in which both bones are sure, as the joint's residual_mm; null without any.
Json ResidualDegJson(const Model& model, const Joint& joint) {
  double squares = 0;
  int count = 0;
  for (size_t k = 0; k < model.scan_fits().size(); ++k) {
    const BoneFits& fits = model.scan_fits()[k];
    if (fits[size_t(joint.child)].Doubtful() || fits[size_t(joint.parent)].Doubtful()) continue;
    squares += model.fit().scan_residuals[k][size_t(joint.child)].head<3>().squaredNorm(), ++count;
  }
  return count > 0 ? Json(DegFromRad(std::sqrt(squares / count))) : Json();
}

Json JointsJson(const Model& model) {
  Json out = Json::array();
  for (const Joint& joint : model.fit().skeleton.joints) {
    if (joint.parent == kNoParent) continue;
    Json dofs = Json::array();
    for (size_t d = 0; d < joint.dofs.size(); ++d)
      dofs.push_back(DofJson(joint.dofs[d], IsShift(d), model.fit().AxisWithinRad(joint.child, d)));
    out.push_back({{"child", model.bone_names()[size_t(joint.child)]},
                   {"parent", model.bone_names()[size_t(joint.parent)]},
                   {"centre", ToJson(joint.centre.lps)},
                   {"residual_mm", joint.residual_mm},
                   {"residual_deg", ResidualDegJson(model, joint)},
                   {"dofs", dofs}});
  }
  return out;
}

Json AnglesJson(const Model& model, size_t scan) {
  const std::vector<std::string> names = model.fit().skeleton.DofNames(model.bone_names());
  Json out = Json::object();
  for (size_t i = 0; i < names.size(); ++i)
    out[names[i]] = DegFromRad(model.fit().scan_angles[scan][Eigen::Index(i)]);
  return out;
}

Certainty CertaintyIn(const Model& model, const BoneFits& fits, size_t bone) {
  return CertaintyOf(model.bones().bones[bone], fits[bone], model.bones().labels.grid.MeanSpacingMm());
}

Json BonesThatAre(Certainty certainty, const Model& model, const BoneFits& fits) {
  Json names = Json::array();
  for (size_t j = 0; j < fits.size(); ++j) {
    if (CertaintyIn(model, fits, j) == certainty) names.push_back(model.bone_names()[j]);
  }
  return names;
}

Json BoneFitsJson(const Model& model, const BoneFits& fits) {
  Json out = Json::object();
  for (size_t j = 0; j < fits.size(); ++j) {
    const PoseBounds bounds = BoundsOf(model.bones().bones[j], fits[j]);
    out[model.bone_names()[j]] = {{"certainty", NameOf(CertaintyIn(model, fits, j))},
                                  {"correlation", fits[j].correlation},
                                  {"turn_sd_deg", DegFromRad(WeakestTurnRad(fits[j]))},
                                  {"centre_sd_mm", CentreSdMm(fits[j])},
                                  {"turn_within_deg", DegFromRad(bounds.turn_rad)},
                                  {"surface_within_mm", bounds.surface_mm},
                                  {"doubtful", fits[j].Doubtful()},
                                  {"note", fits[j].note}};
  }
  return out;
}

Json ScanJson(const Model& model, size_t k) {
  const ModelScan& scan = model.manifest().scans[k];
  const BoneFits& fits = model.scan_fits()[k];
  const ScanVerdict verdict = VerdictOf(model.bones(), fits);
  const auto confidence = model.manifest().ConfidenceOf(scan);
  Json transforms = Json::object(), measures = Json::object();
  for (size_t j = 0; j < fits.size(); ++j)
    transforms[model.bone_names()[j]] = RowMajor(fits[j].scan_from_template);
  for (const auto& [stage, m] : scan.measures) measures[stage] = ToJson(m);
  return {{"name", scan.name},
          {"verdict", NameOf(verdict.kind)},
          {"verdict_note", verdict.note},
          {"scan_from_template", transforms},
          {"joint_angles", AnglesJson(model, k)},
          {"measures", measures},
          {"control_points", scan.control_points},
          {"control_points_per_level", scan.control_points_per_level},
          {"folded_fraction", scan.folded_fraction},
          {"confidence_percent", confidence ? Json(confidence->mean_percent) : Json()},
          {"unsure_fraction", confidence ? Json(confidence->unsure_fraction) : Json()},
          {"doubtful_bones", BonesThatAre(Certainty::kDoubtful, model, fits)},
          {"uncertain_bones", BonesThatAre(Certainty::kUncertain, model, fits)},
          {"coarse_bones", BonesThatAre(Certainty::kCoarse, model, fits)},
          {"bone_fits", BoneFitsJson(model, fits)}};
}

}  // namespace

std::string InfoJson(const Model& model) {
  const ModelManifest& manifest = model.manifest();
  Json scans = Json::array();
  for (size_t k = 0; k < manifest.scans.size(); ++k) scans.push_back(ScanJson(model, k));
  const Json document{{"version", manifest.program_version},
                      {"name", manifest.name},
                      {"region", manifest.region},
                      {"template", manifest.template_scan},
                      {"device", manifest.device},
                      {"method", manifest.method},
                      {"digest", manifest.ContentDigest().Hex()},
                      {"volume", VolumeJson(model.template_scan().volume.grid)},
                      {"bones", BonesJson(model)},
                      {"joints", JointsJson(model)},
                      {"scans", scans},
                      {"warnings", manifest.warnings},
                      {"seconds", manifest.seconds}};
  return document.dump(1);
}

}  // namespace kvx
