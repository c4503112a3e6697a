// model.json: the manifest that names a model's artefacts.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/digest.h"
#include "core/measures.h"
#include "core/pose.h"
#include "core/registered_scan.h"

namespace kvx {

struct ModelScan {
  std::string name;
  Digest scan, fits, registered, example;    // artefact keys
  std::map<std::string, Measures> measures;  // "source", "initialise", "register"
  int64_t control_points = 0;
  std::vector<int64_t> control_points_per_level;  // coarse to fine; none in models of old
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
  // Nothing where the method states none, as the paper's.
  std::optional<ConfidenceSummary> ConfidenceOf(const ModelScan& scan) const;
};

// Of the world whose coordinates a pose has: the template's by angles, that scan's as in a scan, by bone
// transforms one of its own. Models with a scan in common agree about it.
Digest WorldOf(const ModelManifest& manifest, const PoseRequest& pose);

// Throws InputError for an artifact_folder that the document, which is UTF-8, cannot hold.
void RequireUtf8(const std::string& artifact_folder);
void WriteManifest(const std::filesystem::path& file,
                   const ModelManifest& manifest);              // temporary name, fsync, rename
constexpr const char* kModelKind = "kinevox-model";             // of its document
ModelManifest ReadManifest(const std::filesystem::path& file);  // throws NotFound, InputError

}  // namespace kvx
