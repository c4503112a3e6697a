// One function per record.
#include "api/views.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "api/poser_port.h"

namespace kvx {
namespace {

Json OrNull(const std::optional<std::string>& text) { return text ? Json(*text) : Json(); }
Json TimeOrNull(const std::optional<int64_t>& ms) { return ms ? Json(IsoTime(*ms)) : Json(); }

Json Geometry(const Grid& grid) {
  Json json;
  json["size"] = {grid.size.x(), grid.size.y(), grid.size.z()};
  json["spacing"] = {grid.spacing_mm.x(), grid.spacing_mm.y(), grid.spacing_mm.z()};
  json["origin"] = {grid.origin.lps.x(), grid.origin.lps.y(), grid.origin.lps.z()};
  json["direction"] = Json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) json["direction"].push_back(grid.direction(row, column));
  }
  return json;
}

Json RawGeometry(const Grid& grid, ScalarType type) {
  Json json = Geometry(grid);
  json["type"] = NameOf(type);
  return json;
}

std::string Padded(const Json& header) {
  std::string text = header.dump();
  if (text.size() > kRawHeaderBytes) throw std::logic_error("a raw volume's header is too long");
  text.resize(kRawHeaderBytes, ' ');
  return text;
}

Json UploadView(const std::string& id, const std::string& subject, const StoredFile& file,
                int64_t created_ms) {
  Json json;
  json["id"] = id;
  json["subject"] = subject;
  json["sha256"] = file.sha256;
  json["bytes"] = file.bytes;
  json.update(Json::parse(file.facts));
  json["created"] = IsoTime(created_ms);
  return json;
}

}  // namespace

std::string_view NameOf(ScalarType type) {
  switch (type) {
    case ScalarType::kUint8:
      return "uint8";
    case ScalarType::kInt8:
      return "int8";
    case ScalarType::kUint16:
      return "uint16";
    case ScalarType::kInt16:
      return "int16";
    case ScalarType::kUint32:
      return "uint32";
    case ScalarType::kInt32:
      return "int32";
    case ScalarType::kFloat32:
      return "float32";
    case ScalarType::kFloat64:
      return "float64";
  }
  return "";
}

Json FactsJson(const ScanFacts& facts) {
  Json json = Geometry(facts.grid);
  json["modality"] = facts.modality;
  json["type"] = NameOf(facts.stored_as);
  return json;
}

Json FactsJson(const LabelFacts& facts) {
  Json json = Geometry(facts.grid);
  json["labels"] = facts.labels;
  json["list"] = Json::array();
  for (const ProposedBone& bone : facts.bones) json["list"].push_back(View(bone));
  return json;
}

std::string RawHeader(const Grid& grid, ScalarType type) { return Padded(RawGeometry(grid, type)); }

std::string SliceHeader(const Grid& layer, ScalarType type,
                        const std::optional<std::pair<double, double>>& window) {
  Json json = RawGeometry(layer, type);
  if (window) json["window"] = {window->first, window->second};
  return Padded(json);
}

std::string FieldHeader(const Grid& grid, const FieldErrors& errors) {
  Json json = RawGeometry(grid, ScalarType::kFloat32);
  json["components"] = 3;
  json["largest_error_mm"] = errors.largest_mm, json["p99_error_mm"] = errors.p99_mm,
  json["mean_error_mm"] = errors.mean_mm;
  return Padded(json);
}

Json View(const ProposedBone& bone) {
  Json json;
  json["label"] = bone.label;
  json["name"] = bone.name.empty() ? Json() : Json(bone.name);
  json["parent"] = bone.parent.empty() ? Json() : Json(bone.parent);
  json["confidence"] = std::round(bone.confidence * 100) / 100;
  if (!bone.looks_like.empty()) json["looks_like"] = bone.looks_like;
  if (bone.expected_dice) json["expected_dice"] = std::round(*bone.expected_dice * 100) / 100;
  json["voxels"] = bone.voxels;
  json["cm3"] = std::round(bone.cm3 * 1000) / 1000;
  json["centre"] = {bone.centre.lps.x(), bone.centre.lps.y(), bone.centre.lps.z()};
  return json;
}

Json View(const SubjectRecord& subject) {
  Json json;
  json["id"] = subject.id;
  json["name"] = OrNull(subject.name);
  json["region"] = subject.region;
  json["external_id"] = OrNull(subject.external_id);
  json["created"] = IsoTime(subject.created_ms);
  return json;
}

Json View(const ScanRecord& scan) {
  Json json = UploadView(scan.id, scan.subject, scan.file, scan.created_ms);
  json["name"] = scan.name;
  return json;
}

Json View(const BonesRecord& bones) {
  Json json = UploadView(bones.id, bones.subject, bones.file, bones.created_ms);
  json["template"] = bones.template_scan;
  if (!json.contains("kind")) json["kind"] = "labels";
  return json;
}

Json View(const ModelRecord& model) {
  Json json;
  json["id"] = model.id;
  json["subject"] = model.subject;
  json["template"] = model.template_scan;
  json["job"] = model.job;
  json["state"] = model.job_state;
  json["digest"] = OrNull(model.digest);
  json["created"] = IsoTime(model.created_ms);
  return json;
}

Json View(const JobRecord& job) {
  Json json;
  json["id"] = job.id;
  json["kind"] = job.kind;
  json["model"] = job.model.empty() ? Json() : Json(job.model);
  json["state"] = job.state;
  json["stage"] = job.stage;
  json["progress"] = job.progress;
  json["attempt"] = job.attempt;
  json["cancel_requested"] = job.cancel_requested;
  json["priority"] = job.priority;
  if (job.subject) json["subject"] = *job.subject;
  if (job.subject_name) json["subject_name"] = *job.subject_name;
  if (job.batch) json["batch"] = *job.batch;
  json["created"] = IsoTime(job.created_ms);
  json["started"] = TimeOrNull(job.started_ms);
  json["finished"] = TimeOrNull(job.finished_ms);
  if (job.error) json["error"] = Json::parse(*job.error);
  if (job.result) json["result"] = Json::parse(*job.result);
  return json;
}

Json View(const JobRecord& job, const JobEvent& event) {
  Json json = View(job);
  json["state"] = event.state;
  json["stage"] = event.stage;
  json["progress"] = event.progress;
  json["attempt"] = event.attempt;
  if (event.state == "queued") json["started"] = nullptr;
  if (!event.IsLast()) {
    json["finished"] = nullptr;
    json.erase("error");
    json.erase("result");
  }
  return json;
}

Json View(const AuditRecord& record) {
  Json json;
  json["at"] = IsoTime(record.at_ms);
  json["who"] = record.entry.who;
  json["action"] = record.entry.action;
  json["object"] = record.entry.object;
  json["outcome"] = record.entry.outcome;
  return json;
}

Json View(const BatchRecord& batch) {
  Json json;
  json["id"] = batch.id;
  json["name"] = batch.name ? Json(*batch.name) : Json();
  json["created"] = IsoTime(batch.created_ms);
  return json;
}

Json View(const Webhook& webhook) {
  Json json;
  json["id"] = webhook.id;
  json["url"] = webhook.url;
  json["events"] = Json::parse(webhook.events);
  json["created"] = IsoTime(webhook.created_ms);
  return json;
}

template <class Record>
Json PageView(const Page<Record>& page) {
  Json json;
  json["items"] = Json::array();
  for (const Record& item : page.items) json["items"].push_back(View(item));
  json["next"] = page.next_before ? Json(CursorOf(*page.next_before)) : Json();
  return json;
}

template Json PageView(const Page<SubjectRecord>&);
template Json PageView(const Page<ScanRecord>&);
template Json PageView(const Page<BonesRecord>&);
template Json PageView(const Page<ModelRecord>&);
template Json PageView(const Page<JobRecord>&);
template Json PageView(const Page<AuditRecord>&);
template Json PageView(const Page<BatchRecord>&);
template Json PageView(const Page<Webhook>&);

Grid GridOf(const Json& facts) {
  const Json &size = facts.at("size"), &spacing = facts.at("spacing"), &origin = facts.at("origin"),
             &direction = facts.at("direction");
  Grid grid;
  for (int axis = 0; axis < 3; ++axis) {
    grid.size[axis] = size.at(size_t(axis)).get<int>();
    grid.spacing_mm[axis] = spacing.at(size_t(axis)).get<double>();
    grid.origin.lps[axis] = origin.at(size_t(axis)).get<double>();
    for (int row = 0; row < 3; ++row)
      grid.direction(row, axis) = direction.at(size_t(3 * row + axis)).get<double>();
  }
  return grid;
}

Grid GridOf(const StoredFile& volume) { return GridOf(Json::parse(volume.facts)); }

double VoxelsOf(const ScanRecord& scan) { return double(GridOf(scan.file).VoxelCount()); }

}  // namespace kvx
