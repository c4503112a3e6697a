// POST /v1/models {subject, template, scans?, bones?, joints?,
// initial_poses?, options?} becomes a study.json over blobs.
#include "api/handlers/models.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "api/views.h"
#include "core/errors.h"
#include "core/voxels/finer_grid.h"
#include "storage/ids.h"

namespace kvx {
namespace {

std::string RequiredText(const Json& json, const std::string& field) {
  const auto found = json.find(field);
  if (found == json.end() || !found->is_string())
    throw InputError("'" + field + "' is missing or is not a text");
  return found->get<std::string>();
}

// The scans by name or id; all of the subject's, in the order of upload, when the request names none. The
// template is always among them.
std::vector<ScanRecord> ChosenScans(Services& services, const std::string& subject,
                                    const std::string& template_scan, const Json& request) {
  std::vector<ScanRecord> all = services.catalogue.AllScans(subject);
  const auto is_template = [&](const ScanRecord& scan) { return scan.name == template_scan; };
  const auto first = std::ranges::find_if(all, is_template);
  if (first == all.end()) throw NotFound("'template' names a scan that the subject does not have");
  const auto wanted = request.find("scans");
  if (wanted == request.end() || wanted->is_null()) return all;
  if (!wanted->is_array()) throw InputError("'scans' is a list of names of scans");
  std::vector<ScanRecord> chosen;
  for (const Json& item : *wanted) {
    const auto matches = [&](const ScanRecord& scan) { return item == scan.name || item == scan.id; };
    const auto found = std::ranges::find_if(all, matches);
    const std::string where = "scans[" + std::to_string(chosen.size()) + "] names a scan that ";
    if (found == all.end()) throw NotFound(where + "the subject does not have");
    if (std::ranges::any_of(chosen, matches)) throw InputError(where + "is in the list already");
    chosen.push_back(*found);
  }
  if (std::ranges::none_of(chosen, is_template)) chosen.insert(chosen.begin(), *first);
  return chosen;
}

// "bon_...", {"id": "bon_...", "list": [...]}, or the list alone; without an id the template's latest upload.
BonesRecord ChosenBones(Services& services, const std::string& subject, const std::string& template_scan,
                        const Json& bones) {
  const bool told =
      bones.is_string() ? bones != "" : bones.is_null() || bones.is_object() || bones.is_array();
  if (!told) throw InputError("'bones' is an id, an object of id and list, or a list");
  std::string id;
  if (bones.is_string()) id = bones.get<std::string>();
  if (bones.is_object()) {
    RequireFields(bones, {"id", "list"}, "'bones'");
    if (bones.contains("id")) id = RequiredText(bones, "id");
  }
  if (id.empty()) {
    auto latest = services.catalogue.LatestBones(subject, template_scan);
    if (!latest)
      throw NotFound("the template has no label map of bones yet; upload one to the subject's bones");
    return *latest;
  }
  BonesRecord record = services.catalogue.RequireBones(id);
  if (record.subject != subject) throw NotFound("'bones' belongs to another subject");
  return record;
}

Json BoneList(const Json& bones) {
  if (bones.is_array()) return bones;
  if (bones.is_object() && bones.contains("list")) return bones["list"];
  return Json();
}

// Labels that a threshold made are numbered by size,
// so that the region's order does not name them: what was proposed does.
Json ProposedList(const BonesRecord& bones) {
  const Json facts = Json::parse(bones.file.facts);
  if (facts.value("kind", "") != "threshold") return Json();
  Json list = Json::array();
  for (const Json& bone : facts["list"]) {
    if (bone["name"].is_null()) continue;
    if (bone["confidence"].get<double>() < kSureName) {
      throw InputError(
          "'bones' of a threshold need names: which bone is which cannot be told surely; list label, name "
          "and parent");
    }
    list.push_back({{"label", bone["label"]}, {"name", bone["name"]}, {"parent", bone["parent"]}});
  }
  if (list.empty())
    throw InputError("'bones' of a threshold need names: list label, name and parent of each");
  return list;
}

double LimitAt(const Json& options, const char* field, double otherwise) {
  if (!options.contains(field)) return otherwise;
  const Json& value = options[field];
  const bool whole = std::string_view(field) != "max_seconds";
  if (!value.is_number() || !(value.get<double>() >= 0 && value.get<double>() <= 1e9) ||
      (whole && !value.is_number_integer())) {
    throw InputError("'" + std::string(field) + "' is a number from 0 to 1e9" +
                     (whole ? ", without a fraction" : ""));
  }
  return value.get<double>();
}

// {"name", and for "paper" its limits}
Json MethodOf(const Json& request) {
  const auto options = request.find("options");
  if (options == request.end() || options->is_null()) return {{"name", "adaptive"}};
  if (!options->is_object()) throw InputError("'options' is an object");
  RequireFields(*options, {"method", "max_blocks", "max_seconds", "seed"}, "'options'");
  const std::string method = options->contains("method") ? RequiredText(*options, "method") : "adaptive";
  if (method == "paper") {
    return {{"name", method},
            {"max_blocks", int64_t(LimitAt(*options, "max_blocks", 0))},
            {"max_seconds", LimitAt(*options, "max_seconds", 0)},
            {"seed", int64_t(LimitAt(*options, "seed", 1))}};
  }
  if (method != "adaptive") throw InputError("'method' is \"adaptive\" or \"paper\"");
  RequireFields(*options, {"method"}, "'options' of the adaptive method");
  return {{"name", method}};
}

MethodChoice MethodFrom(const Json& stored) {
  if (stored.is_string())
    return {.name = stored.get<std::string>()};  // of jobs that were queued by earlier versions
  return {stored["name"].get<std::string>(), stored.value("max_blocks", int64_t(0)),
          stored.value("max_seconds", 0.0), stored.value("seed", int64_t(1))};
}

struct StudyParts {
  Json study;
  Json files = Json::array();  // {name, content}

  void AddFile(const std::string& name, const StoredFile& file) {
    files.push_back({{"name", name}, {"content", file.content}});
  }
};

// What is not of the right kind is told when the study is read.
void RequireOfBones(const Json& study, const std::vector<Json>& names) {
  const auto unknown = [&](const Json& name) { return std::ranges::find(names, name) == names.end(); };
  for (const Json& joint : study.value("joints", Json::array())) {
    if (!joint.is_object()) continue;
    RequireFields(joint, {"child", "dofs"}, "'joints'");
    if (joint.contains("child") && unknown(joint["child"]))
      throw InputError("'joints' names a child that is none of the bones: " + joint["child"].dump());
  }
  for (const Json& poses : study.value("initial_poses", Json::object())) {
    if (!poses.is_object()) continue;
    for (const auto& [bone, pose] : poses.items()) {
      if (unknown(bone))
        throw InputError("'initial_poses' names a bone that is none of the bones: " + Json(bone).dump());
    }
  }
}

// Refuses labels and bones that are not there now rather than when the job runs.
void RequireKnownBones(const Json& study, const Json& list, const Json& facts) {
  std::vector<Json> names;
  for (const Json& bone : list.is_array() ? list : facts["list"]) {
    if (!bone.is_object()) continue;  // told when the study is read
    names.push_back(bone.value("name", Json()));
    const Json label = bone.value("label", Json());
    if (std::ranges::find(facts["labels"], label) == facts["labels"].end())
      throw InputError("'bones' lists the label " + label.dump() + ", which the label map does not hold");
  }
  RequireOfBones(study, names);
}

StudyParts MakeStudy(Services& services, const std::string& model, const Json& request) {
  const SubjectRecord subject = services.catalogue.RequireSubject(RequiredText(request, "subject"));
  const std::string template_scan = RequiredText(request, "template");
  StudyParts parts;
  parts.study = {{"name", model}, {"region", subject.region}, {"template", template_scan}};
  parts.study["scans"] = Json::array();
  for (const ScanRecord& scan : ChosenScans(services, subject.id, template_scan, request)) {
    // A series lies apart: it may be called as another scan's file is
    const std::string name = (scan.file.suffix.empty() ? "series/" : "scans/") + scan.name + scan.file.suffix;
    parts.study["scans"].push_back({{"name", scan.name}, {"volume", name}});
    parts.AddFile(name, scan.file);
  }
  const Json bones = request.value("bones", Json());
  const BonesRecord chosen = ChosenBones(services, subject.id, template_scan, bones);
  const StoredFile& labels = chosen.file;
  parts.study["bones"]["labels"] = "bones" + labels.suffix;
  parts.AddFile("bones" + labels.suffix, labels);
  Json list = BoneList(bones);
  if (list.is_null()) list = ProposedList(chosen);
  if (!list.is_null()) parts.study["bones"]["list"] = list;
  for (const char* field : {"joints", "initial_poses"}) {
    if (request.contains(field) && !request[field].is_null()) parts.study[field] = request[field];
  }
  RequireKnownBones(parts.study, list, Json::parse(labels.facts));
  return parts;
}

// A little above what `kinevox build` took at its peak where tissue fills most of the view: 0.65 GB for 1.65
// and 1.79 GB for 6.7 million voxels, 85 % of them tissue. With air around, half of it is enough. One scan is
// in memory at a time, beside all that lies on the template's grid.
constexpr double kBytesPerTemplateVoxel = 220, kBytesPerScanVoxel = 12, kBytesAlways = 300e6;
// Where a scan has lost a bone all scans' examples lie beside each other, when the registration has let go.
constexpr double kBytesBesideExamples = 60, kBytesPerExampleVoxel = 13;

// As the registration works on them.
double VoxelsAsCubes(const Grid& grid) {
  return double(FinerGrid(grid, TimesTowardsCubes(grid)).VoxelCount());
}

void Declare(PreparedModel& model, const std::vector<ScanRecord>& scans) {
  double template_voxels = 0, largest = 0;
  for (const ScanRecord& scan : scans) {
    largest = std::max(largest, VoxelsOf(scan));
    if (scan.name == model.template_scan) template_voxels = VoxelsAsCubes(GridOf(scan.file));
  }
  const double per_voxel =
      std::max(kBytesPerTemplateVoxel, kBytesBesideExamples + kBytesPerExampleVoxel * double(scans.size()));
  model.need_bytes = int64_t(kBytesAlways + per_voxel * template_voxels + kBytesPerScanVoxel * largest);
  model.work = template_voxels * double(scans.size());
}

}  // namespace

BuildTask TaskOf(const BlobStore& blobs, const std::string& model, const std::string& stored_request) {
  const Json stored = Json::parse(stored_request);
  BuildTask task{model, stored["study"].dump(), {}, MethodFrom(stored["method"])};
  for (const Json& file : stored["files"]) {
    task.files.push_back({file["name"].get<std::string>(), blobs.PathOf(file["content"].get<std::string>())});
  }
  return task;
}

int PriorityOf(const Json& request, int otherwise) {
  const auto found = request.find("priority");
  if (found == request.end() || found->is_null()) return otherwise;
  const bool whole = found->is_number_unsigned()  // compared as such: a large one is not taken for -1
                         ? found->get<uint64_t>() <= 100
                         : found->is_number_integer() && *found >= -100 && *found <= 100;
  if (!whole) throw InputError("'priority' is a whole number from -100 to 100");
  return found->get<int>();
}

PreparedModel PrepareModel(Services& services, const Json& request, int otherwise_priority) {
  RequireFields(request,
                {"subject", "template", "scans", "bones", "joints", "initial_poses", "options", "priority"},
                "a model");
  PreparedModel model;
  model.id = NewId("mdl");
  const StudyParts parts = MakeStudy(services, model.id, request);
  model.stored = Dump(Json{{"study", parts.study}, {"files", parts.files}, {"method", MethodOf(request)}});
  services.builder.Check(TaskOf(services.blobs, model.id, model.stored));
  model.subject = request["subject"].get<std::string>();
  model.template_scan = request["template"].get<std::string>();
  model.priority = PriorityOf(request, otherwise_priority);
  Declare(model, ChosenScans(services, model.subject, model.template_scan, request));
  services.jobs.RequireAdmissible(model.need_bytes);
  return model;
}

// Within a transaction: the model is there with its job, or neither.
JobRecord SubmitModel(Services& services, const PreparedModel& model,
                      const std::optional<std::string>& batch) {
  NewJob wanted{"build_model", model.id, model.stored, model.priority};
  wanted.need_bytes = model.need_bytes;
  wanted.work = model.work;
  wanted.batch = batch;
  wanted.subject = model.subject;
  services.catalogue.RequireSubject(model.subject);  // it may be removed by now
  const JobRecord job = services.jobs.Submit(wanted);
  ModelRecord record;
  record.id = model.id;
  record.subject = model.subject;
  record.template_scan = model.template_scan;
  record.request = model.stored;
  record.job = job.id;
  services.catalogue.AddModel(record);
  return job;
}

RequestKey ModelKey(const std::string& idempotency_key, std::string_view request) {
  return KeyOf("POST /v1/models", idempotency_key, {request});
}

Answer AnswerOf(const PreparedModel& model, const JobRecord& job) {
  const Json body{{"id", job.model}, {"subject", model.subject}, {"job", job.id}, {"state", job.state}};
  return {202, "/v1/jobs/" + job.id, Dump(body)};
}

Answer CreateModel(Services& services, const std::string& body, const std::string& idempotency_key) {
  const RequestKey key = ModelKey(idempotency_key, body);
  if (auto answer = services.idempotency.Find(key)) return *answer;
  const PreparedModel model = PrepareModel(services, ParseBody(body));
  const Answer answer =
      services.idempotency.Once(key, [&] { return AnswerOf(model, SubmitModel(services, model)); });
  services.jobs.WakeAll();  // workers look again now that the job is committed
  return answer;
}

std::string ListModels(Services& services, const Query& query) {
  const PageRequest page = ParsePage(query, "subject");
  const std::optional<std::string> subject = QueryText(query, "subject");
  if (subject) services.catalogue.RequireSubject(*subject);
  return Dump(PageView(services.catalogue.Models(page, subject)));
}

std::string GetModel(Services& services, const std::string& id) {
  const ModelRecord model = services.catalogue.RequireModel(id);
  Json json = View(model);
  if (model.job_state == "succeeded") json.update(Json::parse(services.poser.InfoJson(id)));
  json["id"] = model.id;
  return Dump(json);
}

}  // namespace kvx
