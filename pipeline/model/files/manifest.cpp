// What is in the file, and the sum that tells a damaged one.
#include "pipeline/model/files/manifest.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "pipeline/io/atomic_file.h"
#include "pipeline/io/whole_file.h"
#include "pipeline/measures/measures_json.h"
#include "pipeline/posing/cut_bricks.h"

namespace kvx {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;              // of model.json
constexpr const char* kSum = "sha256";  // of all other fields; models of before have none
constexpr const char* kDamaged = "model.json is damaged; build the model again";

Measures MeasuresFrom(const Json& json) { return {json.at("ssd"), json.at("cc"), json.at("mi")}; }

Json ToJson(const ModelScan& scan) {
  Json measures = Json::object();
  for (const auto& [stage, values] : scan.measures) measures[stage] = ToJson(values);
  return {{"name", scan.name},
          {"scan", scan.scan.Hex()},
          {"fits", scan.fits.Hex()},
          {"registered", scan.registered.Hex()},
          {"example", scan.example.Hex()},
          {"measures", measures},
          {"control_points", scan.control_points},
          {"control_points_per_level", scan.control_points_per_level},
          {"folded_fraction", scan.folded_fraction},
          {"confidence_percent", scan.confidence.mean_percent},
          {"unsure_fraction", scan.confidence.unsure_fraction}};
}

Digest DigestAt(const Json& json, const char* key) {
  try {
    return Digest::FromHex(json.at(key).get<std::string>());
  } catch (const InputError&) {
    throw InputError(kDamaged);
  }
}

ModelScan ScanFrom(const Json& json) {
  ModelScan scan;
  scan.name = json.at("name");
  scan.scan = DigestAt(json, "scan");
  scan.fits = DigestAt(json, "fits");
  scan.registered = DigestAt(json, "registered");
  scan.example = DigestAt(json, "example");
  for (const auto& [stage, values] : json.at("measures").items()) scan.measures[stage] = MeasuresFrom(values);
  scan.control_points = json.at("control_points");
  scan.control_points_per_level = json.value("control_points_per_level", scan.control_points_per_level);
  scan.folded_fraction = json.at("folded_fraction");
  scan.confidence.mean_percent = json.value("confidence_percent", scan.confidence.mean_percent);
  scan.confidence.unsure_fraction = json.value("unsure_fraction", scan.confidence.unsure_fraction);
  return scan;
}

Json ToJson(const ModelManifest& m) {
  Json json{{"kind", kModelKind},
            {"format", kFormat},
            {"program_version", m.program_version},
            {"name", m.name},
            {"region", m.region},
            {"template", m.template_scan},
            {"device", m.device},
            {"method", m.method},
            {"digest", m.ContentDigest().Hex()},
            {"artifact_folder", m.artifact_folder},
            {"artifact_bytes", m.artifact_bytes.Hex()},
            {"artifacts",
             {{"template", m.template_key.Hex()},
              {"body", m.body.Hex()},
              {"bones", m.bones.Hex()},
              {"weights", m.weights.Hex()},
              {"skeleton", m.skeleton.Hex()}}},
            {"scans", Json::array()},
            {"seconds", m.seconds},
            {"warnings", m.warnings}};
  if (m.moments) json["artifacts"]["moments"] = m.moments->Hex();
  if (m.bricks) json["bricks"] = {{"key", m.bricks->Hex()}, {"version", CutBricks::kVersion}};
  for (const ModelScan& scan : m.scans) json["scans"].push_back(ToJson(scan));
  return json;
}

ModelManifest ManifestFrom(const Json& json) {
  if (json.at("kind") != kModelKind || json.at("format") != kFormat) {
    throw InputError("this model was made by another version of the program; build it again");
  }
  ModelManifest m;
  m.program_version = json.at("program_version");
  m.name = json.at("name");
  m.region = json.at("region");
  m.template_scan = json.at("template");
  m.device = json.at("device");
  m.method = json.at("method");
  m.artifact_folder = json.at("artifact_folder");
  m.artifact_bytes = DigestAt(json, "artifact_bytes");
  const Json& keys = json.at("artifacts");
  m.template_key = DigestAt(keys, "template");
  m.body = DigestAt(keys, "body");
  m.bones = DigestAt(keys, "bones");
  m.weights = DigestAt(keys, "weights");
  m.skeleton = DigestAt(keys, "skeleton");
  if (keys.contains("moments")) m.moments = DigestAt(keys, "moments");
  if (json.contains("bricks")) m.bricks = DigestAt(json["bricks"], "key");
  for (const Json& scan : json.at("scans")) m.scans.push_back(ScanFrom(scan));
  m.seconds = json.at("seconds").get<std::map<std::string, double>>();
  m.warnings = json.value("warnings", m.warnings);
  if (DigestAt(json, "digest") != m.ContentDigest()) throw InputError(kDamaged);
  if (m.bricks && json["bricks"].at("version") != CutBricks::kVersion) m.bricks.reset();
  return m;
}

// Of the document without its own field, however it is laid out.
std::string Sum(Json json) {
  json.erase(kSum);
  return Sha256(json.dump()).Hex();
}

}  // namespace

std::vector<Digest> ModelManifest::Keys() const {
  std::vector<Digest> keys{template_key, body, bones, weights, skeleton};
  if (moments) keys.push_back(*moments);
  for (const ModelScan& s : scans) keys.insert(keys.end(), {s.scan, s.fits, s.registered, s.example});
  if (bricks) keys.push_back(*bricks);
  return keys;
}

std::optional<ConfidenceSummary> ModelManifest::ConfidenceOf(const ModelScan& scan) const {
  return method == "paper" ? std::nullopt : std::optional(scan.confidence);
}

Digest ModelManifest::ContentDigest() const {
  Hasher hasher;
  hasher.Add("model");
  for (const Digest& key : Keys()) hasher.Add(key);
  for (const ModelScan& s : scans) hasher.Add(s.name);
  return hasher.Add(artifact_bytes).Finish();
}

Digest WorldOf(const ModelManifest& manifest, const PoseRequest& pose) {
  if (const auto* as_in = std::get_if<ScanPose>(&pose)) {
    const auto found = std::ranges::find(manifest.scans, as_in->scan, &ModelScan::name);
    return found == manifest.scans.end() ? manifest.template_key : found->scan;
  }
  const auto* bones = std::get_if<BonePose>(&pose);
  if (!bones) return manifest.template_key;
  Hasher hasher;
  hasher.Add("bone transforms").Add(manifest.template_key);
  for (const auto& [bone, scan_from_template] : bones->scan_from_template) {
    hasher.Add(bone);
    for (const double number : RowMajor(scan_from_template))
      hasher.Add(number == 0 ? 0.0 : number);  // -0 is 0
  }
  return hasher.Finish();
}

void RequireUtf8(const std::string& artifact_folder) try {
  Json(artifact_folder).dump();
} catch (const Json::exception&) {
  throw InputError(
      "the path from the model to its artifacts is not UTF-8, which model.json must be; choose another "
      "folder, or leave them in the model's");
}

void WriteManifest(const std::filesystem::path& file, const ModelManifest& manifest) {
  Json json = ToJson(manifest);
  json[kSum] = Sum(json);
  WriteFileAtomically(file, json.dump(1) + "\n");
}

ModelManifest ReadManifest(const std::filesystem::path& file) {
  const std::string text = WholeFile(file);
  if (text.empty() && !std::filesystem::exists(file))
    throw NotFound("there is no model at this path; make one with 'kinevox build'");
  try {
    const Json json = Json::parse(text);
    const ModelManifest manifest = ManifestFrom(json);
    if (json.value(kSum, Sum(json)) != Sum(json)) throw InputError(kDamaged);
    return manifest;
  } catch (const Json::exception&) {
    throw InputError(kDamaged);
  }
}

}  // namespace kvx
