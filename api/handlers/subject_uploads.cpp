// The digest a client sees is that of the bytes it sent;
// an unpacked series is kept under the digest of its files.
#include "api/handlers/subject_uploads.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "api/views.h"
#include "core/errors.h"
#include "core/text/hex_digest.h"
#include "core/text/lower_case.h"
#include "core/voxels/fields_of_view.h"

namespace kvx {
namespace {

constexpr char kNotHere[] = "the service does not have these bytes; send the file itself";

std::string AnnouncedSha256(const Query& query) {
  const std::string text = LowerCase(QueryValue(query, "sha256"));
  if (!text.empty() && !IsHexDigest(text)) throw InputError("'sha256' is 64 hexadecimal digits");
  return text;
}

}  // namespace

Upload::Upload(Services& services, Kind kind, std::string subject, std::string name, UploadFormat format,
               const Query& query, std::string key, std::optional<IncomingBlob> received)
    : services_(services),
      kind_(kind),
      subject_(std::move(subject)),
      name_(std::move(name)),
      previous_(QueryValue(query, "previous")),
      format_(std::move(format)),
      announced_sha256_(AnnouncedSha256(query)),
      idempotency_key_(std::move(key)),
      blob_(received ? *std::move(received)
                     : services.blobs.Receive(format_.suffix, services.upload_quota_bytes)) {}

Upload Upload::OfScan(Services& services, const std::string& subject, const Query& query,
                      const std::string& key, std::optional<IncomingBlob> received) {
  RequireKnown(query, {"name", "filename", "sha256"});
  services.catalogue.RequireSubject(subject);
  const std::string name = QueryValue(query, "name");
  RequireName(name, "'name'");
  const UploadFormat format = RequireUploadFormat(QueryValue(query, "filename"));
  return Upload(services, Kind::kScan, subject, name, format, query, key, std::move(received));
}

Upload Upload::OfBones(Services& services, const std::string& subject, const Query& query,
                       const std::string& key, std::optional<IncomingBlob> received) {
  RequireKnown(query, {"template", "filename", "kind", "previous", "sha256"});
  services.catalogue.RequireSubject(subject);
  const BonesKind bones = BonesKindOf(query);
  if (bones == BonesKind::kThreshold) throw InputError("a threshold needs no file; post it without a body");
  if (bones != BonesKind::kSeeds && !QueryValue(query, "previous").empty())
    throw InputError("'previous' goes with strokes, kind=seeds");
  const std::string name = QueryValue(query, "template");
  RequireName(name, "'template'");
  RequireTemplate(services, subject, name);
  const UploadFormat format = RequireUploadFormat(QueryValue(query, "filename", kBonesFilename));
  if (format.archive) {
    throw InputError(
        "a label map is one file: .nii, .nii.gz, .nrrd or .mha, or .dcm of a DICOM segmentation (SEG)");
  }
  return Upload(services, bones == BonesKind::kSeeds ? Kind::kStrokes : Kind::kBones, subject, name, format,
                query, key, std::move(received));
}

void Upload::RequireFree() const {
  if (kind_ == Kind::kScan && services_.catalogue.FindScan(subject_, name_)) {
    throw Conflict("the subject has a scan of this name already; give the new one another name");
  }
}

std::optional<Answer> Upload::SameAgain(const std::string& sha256) const {
  if (!same_again_is_fine_) return std::nullopt;
  if (kind_ == Kind::kStrokes) throw InputError("send strokes by POST: each time they start a job");
  const std::string folder = "/v1/subjects/" + subject_;
  if (kind_ == Kind::kScan) {
    const auto scan = services_.catalogue.FindScan(subject_, name_);
    if (!scan || scan->file.sha256 != sha256) return std::nullopt;
    return Answer{200, folder + "/scans/" + scan->id, Dump(View(*scan))};
  }
  const auto bones = services_.catalogue.LatestBones(subject_, name_);
  if (!bones || bones->file.sha256 != sha256) return std::nullopt;
  return Answer{200, folder + "/bones/" + bones->id, Dump(View(*bones))};
}

// What is known of the same bytes sent as the same format, if they came before. Only the subject's own
// project may profit: who knows a digest need not know the bytes.
std::optional<StoredFile> Upload::Known(const std::string& sha256) const {
  const auto same_format = [this](const StoredFile& file) {
    return format_.archive ? file.suffix.empty() : file.suffix == format_.suffix;
  };
  if (kind_ == Kind::kStrokes) return std::nullopt;  // no record keeps them
  if (kind_ == Kind::kScan) {
    for (const ScanRecord& scan : services_.catalogue.ScansOfContent(sha256)) {
      if (same_format(scan.file)) return scan.file;
    }
    return std::nullopt;
  }
  const std::string region = services_.catalogue.RequireSubject(subject_).region;
  for (const BonesRecord& bones : services_.catalogue.BonesOfContent(sha256, region)) {
    if (same_format(bones.file)) return bones.file;
  }
  return std::nullopt;
}

bool Upload::IsDamaged(const StoredFile& file) const {
  return !IsIntact(services_.blobs.PathOf(file.content));
}

void Upload::RequireOnTemplate(const Grid& labels) const {
  if (!FieldsOfViewApart(labels, GridOf(RequireTemplate(services_, subject_, name_).file))) return;
  throw InputError(
      "the label map lies elsewhere than the scan given as 'template'; "
      "keep the scan's origin, direction and spacing when saving it");
}

// With an earlier label map the background alone corrects it.
void Upload::RequireStrokes(const LabelFacts& facts) const {
  constexpr int kBackground = 255;
  if (!previous_.empty()) return;
  if (std::ranges::any_of(facts.labels, [](int label) { return label != kBackground; })) return;
  throw InputError("the strokes mark the background alone; bones are 1, 2, ... and 255 is the background");
}

// Checked where the bytes lie now, so that refused strokes leave nothing.
void Upload::PrepareStrokes(const StoredFile& file, const std::filesystem::path& at) {
  RequireStrokes(services_.inspector.InspectLabels(at, "custom", services_.project));
  StoredFile kept = file;
  kept.content = file.sha256;
  segmentation_ = PrepareSegmentation(services_, {subject_, name_, std::nullopt, previous_}, &kept, at);
}

// What the bytes hold; they are not kept yet.
StoredFile Upload::Inspect() {
  StoredFile file{blob_.digest().Hex(), "", format_.suffix, blob_.bytes(), ""};
  if (kind_ == Kind::kStrokes) {
    PrepareStrokes(file, blob_.path());
  } else if (kind_ == Kind::kBones) {
    const std::string region = services_.catalogue.RequireSubject(subject_).region;
    const LabelFacts facts = services_.inspector.InspectLabels(blob_.path(), region, services_.project);
    RequireOnTemplate(facts.grid);
    file.facts = Dump(FactsJson(facts));
  } else if (!format_.archive) {
    file.facts = Dump(FactsJson(services_.inspector.InspectScan(blob_.path(), services_.project)));
  } else {
    folder_.emplace(services_.blobs.ReceiveFolder());
    const auto watch_room = [this](size_t bytes) { room_.Wrote(bytes); };
    file.facts = Dump(FactsJson(
        services_.inspector.InspectSeries(blob_.path(), folder_->path(), services_.project, watch_room)));
    file.suffix.clear();
  }
  return file;
}

std::string Upload::Keep() {
  return folder_ ? services_.blobs.KeepFolder(*std::move(folder_)) : services_.blobs.Keep(std::move(blob_));
}

RequestKey Upload::KeyOfRequest(const std::string& sha256) const {
  const std::string folder = "/v1/subjects/" + subject_ + (kind_ == Kind::kScan ? "/scans" : "/bones");
  const std::string scope = same_again_is_fine_ ? "PUT " + folder + "/" + name_ : "POST " + folder;
  const char* kind = kind_ == Kind::kStrokes ? "strokes" : "file";
  return KeyOf(scope, idempotency_key_, {kind, name_, previous_, sha256 + format_.suffix});
}

Answer Upload::Record(const StoredFile& file) {
  const std::string folder = "/v1/subjects/" + subject_;
  if (kind_ == Kind::kStrokes) return SubmitSegmentation(services_, segmentation_);
  if (kind_ == Kind::kScan) {
    const ScanRecord scan = services_.catalogue.AddScan(subject_, name_, file);
    return {201, folder + "/scans/" + scan.id, Dump(View(scan))};
  }
  const BonesRecord bones = services_.catalogue.AddBones(subject_, name_, file);
  return {201, folder + "/bones/" + bones.id, Dump(View(bones))};
}

// Of the whole, sent or announced.
std::string Upload::CloseAndCheck() {
  blob_.Close();
  if (Empty() && announced_sha256_.empty()) throw InputError("the body is empty; send the file itself");
  const std::string sha256 = Empty() ? announced_sha256_ : blob_.digest().Hex();
  if (!announced_sha256_.empty() && sha256 != announced_sha256_) {
    throw InputError("the bytes do not have the sha256 announced; send the file again");
  }
  return sha256;
}

// Removals of subjects wait only while bytes that are there, or placed now, become those of a record.
Answer Upload::Finish(const Also& also) {
  const std::string sha256 = CloseAndCheck();
  const RequestKey key = KeyOfRequest(sha256);
  if (auto answer = services_.idempotency.Find(key)) return *answer;
  while (true) {
    const std::optional<StoredFile> known = Known(sha256);
    const bool damaged = known && IsDamaged(*known);
    if (!damaged) {  // else it is mended first, whoever refers to it
      if (auto answer = SameAgain(sha256)) return *answer;
      RequireFree();
    }
    if (Empty() && (!known || damaged)) throw NotFound(kNotHere);
    if (known && kind_ == Kind::kBones) RequireOnTemplate(GridOf(*known));
    StoredFile file = known && !damaged ? *known : Inspect();
    try {
      if (auto made = KeepAndRecord(key, file, also)) return *made;
    } catch (...) {
      if (!file.content.empty()) services_.retention.DropUnrecorded(file.content);
      throw;
    }
  }
}

// Inspect leaves `content` empty; it is set once the bytes are kept. No answer where those that were known
// have gone just now.
std::optional<Answer> Upload::KeepAndRecord(const RequestKey& key, StoredFile& file, const Also& also) {
  const auto kept = services_.blobs.KeepRemovalOut();
  if (file.content.empty())
    file.content = Keep();
  else if (!Known(file.sha256))
    return std::nullopt;
  const Answer made = services_.idempotency.Once(key, [&] {
    services_.catalogue.RequireSubject(subject_);               // it may be removed by now
    const std::optional<Answer> same = SameAgain(file.sha256);  // sent twice, and the other was faster
    const Answer answer = same ? *same : Record(file);
    if (also) also(answer);
    return answer;
  });
  if (kind_ == Kind::kStrokes) services_.jobs.WakeAll();
  return made;
}

}  // namespace kvx
