// Packing of the manifest. Field names are read by scoring tools: add freely, rename nothing.
#include "pipeline/phantom/manifest.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace kvx::phantom {
namespace {

using Json = nlohmann::ordered_json;
using Eigen::Vector3d;

Json Numbers(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json Rows(const RigidTransform& motion) {
  const Eigen::Matrix4d m = motion.Matrix();
  Json rows = Json::array();
  for (int r = 0; r < 4; ++r) rows.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
  return rows;
}

std::vector<Vector3d> Centroids(const LabelMap& labels, const ScanGrid& grid, size_t bones) {
  std::vector<Vector3d> sums(bones, Vector3d::Zero());
  std::vector<double> counts(bones, 0);
  size_t voxel = 0;
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      for (int i = 0; i < grid.size.x(); ++i, ++voxel) {
        const int label = labels.values[voxel];
        if (label > 0) sums[size_t(label - 1)] += grid.At(Vector3d(i, j, k)), ++counts[size_t(label - 1)];
      }
    }
  }
  for (size_t b = 0; b < bones; ++b) sums[b] /= std::max(1.0, counts[b]);
  return sums;
}

Json Bones(const ManifestInputs& in) {
  const std::vector<Vector3d> centroids = Centroids(in.bone_labels, in.scanner.grid, in.anatomy.bones.size());
  Json bones = Json::array();
  for (size_t b = 0; b < in.anatomy.bones.size(); ++b) {
    const PhantomBone& bone = in.anatomy.bones[b];
    bones.push_back({{"label", b + 1},
                     {"name", bone.name},
                     {"parent", bone.parent + 1},
                     {"centroid", Numbers(centroids[b])}});
  }
  return bones;
}

Json Joints(const Anatomy& anatomy) {
  Json joints = Json::array();
  for (const PhantomJoint& joint : anatomy.joints) {
    Json axes = Json::object();
    for (const PhantomAxis& axis : joint.axes) axes[axis.name] = Numbers(axis.direction);
    joints.push_back({{"child", joint.child + 1},
                      {"parent", joint.parent + 1},
                      {"name", anatomy.bones[size_t(joint.child)].name},
                      {"cor", Numbers(joint.centre)},
                      {"axes", axes},
                      {"bends", joint.bends}});
  }
  return joints;
}

Json Pose(const PoseRecord& record) {
  const PhantomPose& pose = record.pose;
  Json slop = Json::object(), motions = Json::array();
  for (const auto& [bone, twist] : pose.slop) {
    slop[bone] = {{"rot_deg", Numbers(twist.head<3>() * DegFromRad(1.0))},
                  {"shift_mm", Numbers(twist.tail<3>())}};
  }
  for (const RigidTransform& motion : record.posed.posed_from_template)
    motions.push_back(Rows(pose.scan_from_posed * motion));
  const std::string stem = PoseFileStem(pose.index);
  return {{"index", pose.index},
          {"file", stem + ".nii.gz"},
          {"points", "truth/" + stem + "_points.npz"},
          {"name", pose.name},
          {"set", pose.seen ? "train" : "unseen"},
          {"angles", Json(pose.angles_deg)},
          {"slop", slop},
          {"global_motion", Rows(pose.scan_from_posed)},
          {"T", motions},
          {"inverted", record.posed.inverted_share},
          {"folded", record.faults.folded_share},
          {"overlapping", record.faults.overlapping_share},
          {"overlap_mm", std::max(record.posed.overlap_mm, record.faults.overlap_mm)},
          {"jacobian", {record.posed.jacobian_low, record.posed.jacobian_high}},
          {"in_fov", record.in_fov},
          {"hidden", record.hidden},
          {"soft_vs_blend_mm", record.soft_vs_blend_mm},
          {"solver",
           {{"steps", record.posed.steps},
            {"iterations", record.posed.iterations},
            {"residual", record.posed.residual}}}};
}

Json GridOf(const ScanGrid& grid) {
  const Vector3d o = grid.Origin(), s = grid.spacing_mm;
  return {
      {"dim", {grid.size.x(), grid.size.y(), grid.size.z()}},
      {"voxel_mm", Numbers(s)},
      {"affine",
       {{s.x(), 0.0, 0.0, o.x()}, {0.0, s.y(), 0.0, o.y()}, {0.0, 0.0, s.z(), o.z()}, {0.0, 0.0, 0.0, 1.0}}}};
}

const char* KindOf(const Anatomy& anatomy) { return anatomy.region == Region::kHand ? "hand" : "knee"; }

}  // namespace

std::string PoseFileStem(int index) {
  return std::string("pose") + (index < 10 ? "0" : "") + std::to_string(index);
}

Json Manifest(const ManifestInputs& in) {
  Json tissues = Json::array(), poses = Json::array();
  for (int t = 0; t < kTissueCount; ++t) tissues.push_back(NameOf(Tissue(t)));
  for (const PoseRecord& record : in.poses) poses.push_back(Pose(record));
  return {
      {"kind", KindOf(in.anatomy)},
      {"seed", in.seed},
      {"modality", "mr"},
      {"units", "mm, degrees; world = scanner frame (NIfTI RAS+)"},
      {"snr", in.snr},
      {"noise_sigma", in.scanner.noise_sigma},
      {"cell_mm", in.anatomy.cell_mm},
      {"material_mm", in.material_mm},
      {"tissues", tissues},
      {"tissue_mean", in.tissues.means()},
      {"transform_convention", "T[j] is a 4x4 row-major matrix taking template world mm to pose world mm"},
      {"bones", Bones(in)},
      {"joints", Joints(in.anatomy)},
      {"poses", poses},
      {"grid", GridOf(in.scanner.grid)}};
}

Json StudyFile(const Anatomy& anatomy, const std::string& name, const std::vector<PoseRecord>& poses) {
  Json scans = Json::array(), bones = Json::array();
  for (const PoseRecord& record : poses) {
    const std::string stem = PoseFileStem(record.pose.index);
    if (record.pose.seen) scans.push_back({{"name", stem}, {"volume", stem + ".nii.gz"}});
  }
  for (size_t b = 0; b < anatomy.bones.size(); ++b) {
    const int parent = anatomy.bones[b].parent;
    bones.push_back({{"label", b + 1},
                     {"name", anatomy.bones[b].name},
                     {"parent", parent < 0 ? Json(nullptr) : Json(anatomy.bones[size_t(parent)].name)}});
  }
  return {{"name", name},
          {"region", KindOf(anatomy)},
          {"template", PoseFileStem(0)},
          {"scans", scans},
          {"bones", {{"labels", "bones_template.nii.gz"}, {"list", bones}}}};
}

}  // namespace kvx::phantom
