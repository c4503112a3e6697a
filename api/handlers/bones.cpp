// Strokes and the scan are held by the job's request until it has ended; the label map then stands for
// itself.
#include "api/handlers/bones.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "api/handlers/stored_volumes.h"
#include "api/views.h"
#include "core/errors.h"
#include "storage/ids.h"

namespace kvx {
namespace {

constexpr const char* kSegmentKind = "segment_bones";
constexpr const char* kMadeSuffix = ".nii.gz";

// Above what `kinevox segment` took at its peak, of which some 140 MB are the program: MR from strokes 220 MB
// for a knee of 1.1 million voxels, 1.15 GB for one of 8.9 million; a CT 340 MB for a torso of 1.4
// million, 2.1 GB for one of 105 million, whose bones are looked for on blocks of voxels, one by each thread.
// Of MR that is stored in another order than it is looked at, there is a copy of 8 to 10 bytes a voxel.
constexpr double kBytesAlways = 200e6, kBytesPerVoxel = 120;
constexpr double kCtBytesPerVoxel = 18, kCtBytesPerThread = 50e6;

std::optional<double> LevelOf(const Query& query) {
  const std::string text = QueryValue(query, "threshold", "auto");
  if (text == "auto") return std::nullopt;
  return ParseNumber(text, "'threshold', a level in HU or auto,");
}

Json FileJson(const std::string& name, const StoredFile& file) {
  return {{"name", name + file.suffix}, {"content", file.content}};
}

SegmentTask TaskOf(const BlobStore& blobs, const Json& stored) {
  const auto file = [&](const Json& json) {
    return StudyFile{json["name"].get<std::string>(), blobs.PathOf(json["content"].get<std::string>())};
  };
  SegmentTask task;
  task.scan = file(stored["files"][0]);
  if (stored["files"].size() > 1) task.strokes = file(stored["files"][1]);
  if (stored["files"].size() > 2) task.previous = file(stored["files"][2]);
  if (!stored["level_hu"].is_null()) task.level_hu = stored["level_hu"].get<double>();
  task.region = stored["region"].get<std::string>();
  return task;
}

BonesRecord RequireBonesOf(Services& services, const std::string& subject, const std::string& id) {
  BonesRecord bones = services.catalogue.RequireBones(id);
  if (bones.subject != subject) throw NotFound("the subject has no such label map of bones");
  return bones;
}

// The newest of a template where its name is given.
BonesRecord RequireBonesCalled(Services& services, const std::string& subject,
                               const std::string& id_or_template) {
  if (LooksLikeId(id_or_template, "bon")) return RequireBonesOf(services, subject, id_or_template);
  auto latest = services.catalogue.LatestBones(subject, id_or_template);
  if (!latest) throw NotFound("the subject has no such label map of bones");
  return *std::move(latest);
}

StoredFile RequirePrevious(Services& services, const SegmentationRequest& request) {
  const BonesRecord previous = RequireBonesOf(services, request.subject, request.previous);
  if (previous.template_scan == request.template_scan) return previous.file;
  throw InputError("'previous' is a label map of another scan; name one of the template's, or leave it out");
}

bool IsCt(const ScanRecord& scan) { return Json::parse(scan.file.facts).value("modality", "") == "CT"; }

}  // namespace

int64_t SegmentationBytes(double voxels, bool ct) {
  if (!ct) return int64_t(kBytesAlways + kBytesPerVoxel * voxels);
  const double threads = std::max(1u, std::thread::hardware_concurrency());
  return int64_t(kBytesAlways + kCtBytesPerThread * threads + kCtBytesPerVoxel * voxels);
}

BonesKind BonesKindOf(const Query& query) {
  const std::string kind = QueryValue(query, "kind", "labels");
  if (kind == "labels") return BonesKind::kLabels;
  if (kind == "seeds") return BonesKind::kSeeds;
  if (kind == "threshold") return BonesKind::kThreshold;
  throw InputError("'kind' is \"labels\", \"seeds\" (strokes) or \"threshold\" (of a CT)");
}

ScanRecord RequireTemplate(Services& services, const std::string& subject, const std::string& name) {
  const auto scan = services.catalogue.FindScan(subject, name);
  if (!scan) throw NotFound("the subject has no scan of the name given as 'template'; upload it first");
  return *scan;
}

PreparedSegmentation PrepareSegmentation(Services& services, const SegmentationRequest& request,
                                         const StoredFile* strokes, const std::filesystem::path& at) {
  const ScanRecord scan = RequireTemplate(services, request.subject, request.template_scan);
  PreparedSegmentation made{request.subject, request.template_scan, Catalogue::NewBonesId(), "", 0,
                            VoxelsOf(scan)};
  made.need_bytes = SegmentationBytes(made.work, !strokes || IsCt(scan));
  services.jobs.RequireAdmissible(made.need_bytes);
  Json stored{{"subject", request.subject},
              {"template", request.template_scan},
              {"bones", made.bones},
              {"region", services.catalogue.RequireSubject(request.subject).region},
              {"kind", strokes ? "seeds" : "threshold"},
              {"level_hu", request.level_hu ? Json(*request.level_hu) : Json()},
              {"files", Json::array({FileJson("scan", scan.file)})}};
  SegmentTask task = TaskOf(services.blobs, stored);
  if (strokes) task.strokes = StudyFile{"strokes" + strokes->suffix, at};
  std::optional<StoredFile> previous;
  if (!request.previous.empty()) {
    previous = RequirePrevious(services, request);
    task.previous = StudyFile{"previous" + previous->suffix, services.blobs.PathOf(previous->content)};
  }
  {
    const std::shared_ptr<void> turn = services.reading_turn();
    services.builder.CheckSegment(task);
  }
  if (strokes) stored["files"].push_back(FileJson("strokes", *strokes));
  if (previous) stored["files"].push_back(FileJson("previous", *previous));
  made.stored = Dump(stored);
  return made;
}

Answer SubmitSegmentation(Services& services, const PreparedSegmentation& segmentation) {
  NewJob wanted{kSegmentKind, "", segmentation.stored};
  wanted.need_bytes = segmentation.need_bytes;
  wanted.work = segmentation.work;
  wanted.subject = segmentation.subject;
  services.catalogue.RequireSubject(segmentation.subject);  // it may be removed by now
  const JobRecord job = services.jobs.Submit(wanted);
  const Json body{{"id", segmentation.bones}, {"job", job.id}, {"state", job.state}};
  return {202, "/v1/jobs/" + job.id, Dump(body)};
}

Answer CreateThresholdBones(Services& services, const std::string& subject, const Query& query,
                            const std::string& idempotency_key) {
  RequireKnown(query, {"template", "kind", "threshold"});
  services.catalogue.RequireSubject(subject);
  const std::string template_scan = QueryValue(query, "template");
  RequireName(template_scan, "'template'");
  const std::optional<double> level_hu = LevelOf(query);
  const RequestKey key = KeyOf("POST /v1/subjects/" + subject + "/bones", idempotency_key,
                               {"threshold", template_scan, level_hu ? std::to_string(*level_hu) : "auto"});
  if (auto answer = services.idempotency.Find(key)) return *answer;
  const PreparedSegmentation made =
      PrepareSegmentation(services, {subject, template_scan, level_hu, ""}, nullptr, {});
  const Answer answer = services.idempotency.Once(key, [&] { return SubmitSegmentation(services, made); });
  services.jobs.WakeAll();
  return answer;
}

std::string ListBones(Services& services, const std::string& subject, const Query& query) {
  const PageRequest page = ParsePage(query);
  services.catalogue.RequireSubject(subject);
  return Dump(PageView(services.catalogue.Bones(subject, page)));
}

std::string GetBones(Services& services, const std::string& subject, const std::string& id_or_template) {
  return Dump(View(RequireBonesCalled(services, subject, id_or_template)));
}

FileAnswer GetBonesVolume(Services& services, const std::string& subject, const std::string& id_or_template,
                          const Query& query, const Conditions& conditions) {
  RequireKnown(query, {"format"});
  const std::string format = FormatAmong(query, {"nii.gz", "nii", "nrrd", "mha"}, "a label map");
  const BonesRecord bones = RequireBonesCalled(services, subject, id_or_template);
  const auto convert = [&](const StudyFile& stored, const std::filesystem::path& out) {
    services.builder.ConvertLabels(stored, out);
  };
  return AnswerWithStored(services, bones.file, {bones.id, format}, conditions, convert);
}

MadeBones MakeBones(Services& services, const std::string& stored_request, const Progress& progress) {
  const Json stored = Json::parse(stored_request);
  const IncomingFolder folder = services.blobs.ReceiveFolder();
  const std::filesystem::path out = folder.path() / ("bones" + std::string(kMadeSuffix));
  const SegmentOutcome made = services.builder.Segment(TaskOf(services.blobs, stored), out, progress);
  IncomingBlob blob = services.blobs.Adopt(out, kMadeSuffix);
  Json facts = FactsJson(made.facts);
  facts["kind"] = stored["kind"];
  facts["warnings"] = made.warnings;
  StoredFile file{blob.digest().Hex(), "", kMadeSuffix, blob.bytes(), Dump(facts)};
  const std::string subject = stored["subject"], template_scan = stored["template"], id = stored["bones"];
  const Json result{{"bones", id},
                    {"subject", subject},
                    {"template", template_scan},
                    {"content", "/v1/subjects/" + subject + "/bones/" + id + "/volume"},
                    {"list", facts["list"]},
                    {"warnings", made.warnings}};
  // Held until the record is committed: nobody removes the bytes in between.
  auto kept = std::make_shared<std::shared_lock<std::shared_mutex>>(services.blobs.KeepRemovalOut());
  file.content = services.blobs.Keep(std::move(blob));
  return {Dump(result), [&services, subject, template_scan, id, file, kept] {
            // A service beside this process may have removed another subject that had the same bytes
            if (!std::filesystem::exists(services.blobs.PathOf(file.content)))
              throw Unavailable("the bones were removed with another subject; they are made again");
            services.catalogue.AddBones(subject, template_scan, file, id);
          }};
}

}  // namespace kvx
