// --joint, --pose and --scan: which pose is asked for.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/model/model.h"
#include "pipeline/posing/key_frames.h"

namespace CLI {
class App;
}

namespace kvx {

struct PoseOptions {
  std::vector<std::string> joints;  // "tibia.flexion=35", degrees
  std::filesystem::path pose_file;
  std::string scan;
  std::string mode = "evd";
  std::string space = "local", basis = "rbf";

  Model Load(const std::filesystem::path& model) const;  // with the pose space asked for
  PoseRequest Request() const;                           // throws UsageError, InputError, NotFound
  DeformationMode Mode() const;
};

// Adds --joint, --pose, --scan (exactly one kind must be given) and --mode.
void AddPoseOptions(CLI::App& command, PoseOptions& options);

// For commands that load the model themselves: adds MODEL, those options, and --space and --basis.
void AddPosedModel(CLI::App& command, std::filesystem::path& model, PoseOptions& options);

// Adds --modality, for volumes that are written as DICOM.
void AddModality(CLI::App& command, std::string& modality);

// "tibia.flexion=35" -> name and radians; throws UsageError.
std::pair<std::string, double> ParseJoint(const std::string& text);

// Warns on stderr of a scan that does not belong to its study (ScanVerdict). No word on the template.
void WarnOfScan(const Model& model, const std::string& scan);

// As WarnOfScan, and of joints beyond their limits, with how far outside the examples the model is asked to
// go; a scan itself asks nothing of joints.
void WarnOfPose(const Model& model, const PoseRequest& request, const ResolvedPose& pose);
// The same of all key frames at once: of each joint what is farthest beyond.
void WarnOfMotion(const Model& model, const KeyFrames& motion);

// The model and the pose asked of it, with the warnings of WarnOfPose.
struct AskedPose {
  Model model;
  ResolvedPose pose;
};
AskedPose LoadPosed(const PoseOptions& options, const std::filesystem::path& model);
// `request`: that of the options, read once: its file may be a pipe.
AskedPose LoadPosed(const PoseOptions& options, const PoseRequest& request,
                    const std::filesystem::path& model);

}  // namespace kvx
