// JSON to PoseRequest; degrees outside, radians inside.
#include "pipeline/model/files/pose_file.h"

#include "core/text/json_object.h"
#include "pipeline/model/files/json_field.h"
#include "pipeline/model/files/text_file.h"

namespace kvx {
namespace {

PoseRequest ParseAngles(const JsonField& joints) {
  AnglePose pose;
  for (const auto& [name, value] : joints.Members()) pose.angles_rad[name] = RadFromDeg(value.Number());
  return pose;
}

PoseRequest ParseBonePose(const JsonField& bones) {
  BonePose pose;
  for (const auto& [name, value] : bones.Members()) pose.scan_from_template[name] = value.Rigid();
  return pose;
}

}  // namespace

PoseRequest PoseOf(const JsonField& pose) {
  const int given = pose.Has("joints") + pose.Has("scan_from_template") + pose.Has("scan");
  const std::string what = pose.name().empty() ? "a pose" : pose.name();
  if (given != 1) throw InputError(what + " must hold exactly one of joints, scan_from_template and scan");
  if (pose.Has("joints")) return ParseAngles(pose.At("joints"));
  if (pose.Has("scan_from_template")) return ParseBonePose(pose.At("scan_from_template"));
  return ScanPose{pose.At("scan").Name()};
}

PoseRequest ParsePose(std::string_view json) {
  const nlohmann::json document = ParseObject<nlohmann::json>(json, "the pose");
  const JsonField pose(document, "");
  pose.RequireOnly({"joints", "scan_from_template", "scan"}, "a pose");
  return PoseOf(pose);
}

PoseRequest ReadPose(const std::filesystem::path& file) { return ParsePose(FileText(file, "the pose file")); }

}  // namespace kvx
