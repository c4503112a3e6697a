// Command-line poses become PoseRequests; degrees end here.
#include "cli/options/pose_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <set>

#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "core/joint_values.h"
#include "core/text/parse_number.h"
#include "pipeline/model/files/pose_file.h"
#include "pipeline/model/scan_verdict.h"

namespace kvx {
namespace {

std::string Text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

double BeyondRad(const DegreeOfFreedom& dof, double angle_rad) {
  return std::max({dof.min_rad - angle_rad, angle_rad - dof.max_rad, 0.0});
}

// "tibia.flexion = 120 is beyond -5..85 degrees", or nothing.
std::string BeyondLimits(const DegreeOfFreedom& dof, const std::string& name, double angle_rad,
                         const char* unit) {
  constexpr double kSlackRad = 1e-6;
  if (BeyondRad(dof, angle_rad) <= kSlackRad) return {};
  return name + " = " + Text(DegFromRad(angle_rad)) + " is beyond " + Text(DegFromRad(dof.min_rad)) + ".." +
         Text(DegFromRad(dof.max_rad)) + " " + unit;
}

// What poses ask of the joints.
struct AskedOfJoints {
  JointAngles angles;
  double extrapolation = 0;  // example distances
};

AskedOfJoints AskedBy(const Model& model, const PoseRequest& request, const ResolvedPose& pose) {
  const auto* given = std::get_if<AnglePose>(&request);
  return {given ? model.Resolver().AnglesOf(*given)
                : AnalysePose(model.fit().skeleton, pose.scan_from_template).angles,
          LargestExtrapolation(pose)};
}

// Of each motion the angle that is farther beyond its limits.
void TakeFarther(const Skeleton& skeleton, const AskedOfJoints& other, AskedOfJoints& asked) {
  Eigen::Index position = 0;
  for (const Joint& joint : skeleton.joints) {
    for (const DegreeOfFreedom& dof : joint.dofs) {
      double& angle_rad = asked.angles[position];
      const double other_rad = other.angles[position++];
      if (BeyondRad(dof, other_rad) > BeyondRad(dof, angle_rad)) angle_rad = other_rad;
    }
  }
  asked.extrapolation = std::max(asked.extrapolation, other.extrapolation);
}

void WarnOfJoints(const Model& model, const AskedOfJoints& asked) {
  const Skeleton& skeleton = model.fit().skeleton;
  const std::vector<std::string> names = skeleton.DofNames(model.bone_names());
  std::string beyond;
  size_t position = 0;
  for (const Joint& joint : skeleton.joints) {
    for (size_t d = 0; d < joint.dofs.size(); ++d, ++position) {
      const std::string sentence =
          BeyondLimits(joint.dofs[d], names[position], asked.angles[Eigen::Index(position)],
                       IsShift(d) ? "mm" : "degrees");
      if (!sentence.empty()) beyond += (beyond.empty() ? "" : "; ") + sentence;
    }
  }
  if (beyond.empty()) return;
  Warn(beyond + "; the model extrapolates by " + Text(asked.extrapolation) +
       " example distances (0: inside the examples)");
}

}  // namespace

void AddModality(CLI::App& command, std::string& modality) {
  command
      .add_option("--modality", modality,
                  "What a DICOM series says it is; without it what the template scan's own file said")
      ->check(CLI::IsMember({"MR", "CT"}));
}

std::pair<std::string, double> ParseJoint(const std::string& text) {
  const size_t equals = text.find('=');
  const bool named = equals != text.npos && equals > 0 && text.find('.') < equals;
  const auto degrees = named ? ParseFinite(std::string_view(text).substr(equals + 1)) : std::nullopt;
  if (!degrees)
    throw UsageError("--joint takes BONE.MOTION=DEGREES, as in tibia.flexion=35; '" + text + "' is not that");
  return {text.substr(0, equals), RadFromDeg(*degrees)};
}

Model PoseOptions::Load(const std::filesystem::path& model) const {
  Model loaded = Model::Load(model);
  if (space != "local" || basis != "rbf") loaded.UsePoseSpace({PoseBasisFromName(basis), space == "global"});
  return loaded;
}

PoseRequest PoseOptions::Request() const {
  if (!pose_file.empty()) return FromFile(pose_file, ReadPose);
  if (!scan.empty()) return ScanPose{scan};
  AnglePose pose;
  for (const std::string& joint : joints) {
    if (!pose.angles_rad.insert(ParseJoint(joint)).second)
      throw UsageError("--joint " + joint + " sets a motion twice");
  }
  return pose;
}

DeformationMode PoseOptions::Mode() const { return DeformationModeFromName(mode); }

void AddPoseOptions(CLI::App& command, PoseOptions& options) {
  CLI::Option_group* which = command.add_option_group("pose", "Which pose");
  which
      ->add_option(
          "--joint", options.joints,
          "BONE.MOTION=DEGREES (mm of a shift), may be repeated; motions not named are 0, the template's")
      ->take_all()
      ->allow_extra_args(false)
      ->type_name("JOINT");
  which->add_option("--pose", options.pose_file, "Pose file: JSON with \"joints\" or \"scan_from_template\"")
      ->type_name("FILE");
  which->add_option("--scan", options.scan, "As in this scan of the study")->type_name("NAME");
  which->require_option(1);
  AddMode(command, options.mode);
}

void AddPosedModel(CLI::App& command, std::filesystem::path& model, PoseOptions& options) {
  AddModelFolder(command, model);
  AddPoseOptions(command, options);
  command
      .add_option("--space", options.space,
                  "local: a bone's tissue looks at the joints that move it; global: at all alike")
      ->check(CLI::IsMember({"local", "global"}))
      ->capture_default_str();
  command
      .add_option("--basis", options.basis, "Between the examples: rbf, or normalised (shares that sum to 1)")
      ->check(CLI::IsMember({"rbf", "normalised"}))
      ->capture_default_str();
}

void WarnOfScan(const Model& model, const std::string& scan) {
  const ScanVerdict verdict = VerdictOf(model, scan);
  if (!verdict.note.empty()) Warn("scan '" + scan + "': " + verdict.note);
}

void WarnOfPose(const Model& model, const PoseRequest& request, const ResolvedPose& pose) {
  if (const auto* of_scan = std::get_if<ScanPose>(&request)) return WarnOfScan(model, of_scan->scan);
  WarnOfJoints(model, AskedBy(model, request, pose));
}

void WarnOfMotion(const Model& model, const KeyFrames& motion) {
  const Skeleton& skeleton = model.fit().skeleton;
  AskedOfJoints asked{JointAngles::Zero(skeleton.DofCount())};
  std::set<std::string> scans;
  for (const KeyFrame& frame : motion.frames) {
    if (const auto* of_scan = std::get_if<ScanPose>(&frame.pose)) {
      if (scans.insert(of_scan->scan).second) WarnOfScan(model, of_scan->scan);
      continue;
    }
    const ResolvedPose pose = model.Resolve(frame.pose, DeformationMode::kVbd);
    TakeFarther(skeleton, AskedBy(model, frame.pose, pose), asked);
  }
  WarnOfJoints(model, asked);
}

AskedPose LoadPosed(const PoseOptions& options, const std::filesystem::path& folder) {
  return LoadPosed(options, options.Request(), folder);
}

AskedPose LoadPosed(const PoseOptions& options, const PoseRequest& request,
                    const std::filesystem::path& folder) {
  Model model = options.Load(folder);
  ResolvedPose pose = model.Resolve(request, options.Mode());
  WarnOfPose(model, request, pose);
  return {std::move(model), std::move(pose)};
}

}  // namespace kvx
