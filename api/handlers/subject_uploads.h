// POST and PUT of a subject's scans and bones: checked before the first byte, streamed, read once, then kept.
// Refused ones leave nothing. Resumable uploads (resumable_uploads.h) end here when their last byte has come.
#pragma once
#include <functional>
#include <optional>
#include <span>

#include "api/handlers/bones.h"
#include "api/request.h"
#include "api/room_watch.h"
#include "api/services.h"
#include "api/upload_format.h"

namespace kvx {

constexpr char kBonesFilename[] = "bones.nii.gz";  // where a label map's name is not given

// POST /v1/subjects/{s}/scans?name=pose00&filename=pose00.nii.gz, or .../bones?template=pose00&filename=...
// Bones of kind=seeds are strokes: the answer is 202 with the job that makes a label map of them; with
// previous=bon_... it changes only what the strokes contradict in that one.
// With sha256=..., the bytes must have that digest;
// where the service has them already, the body may be empty.
class Upload {
 public:
  // `received`: the file is here already, as a resumable upload's is.
  static Upload OfScan(Services& services, const std::string& subject, const Query& query,
                       const std::string& idempotency_key,
                       std::optional<IncomingBlob> received = std::nullopt);
  static Upload OfBones(Services& services, const std::string& subject, const Query& query,
                        const std::string& idempotency_key,
                        std::optional<IncomingBlob> received = std::nullopt);

  void SameAgainIsFine() {
    same_again_is_fine_ = true;
  }                          // PUT: the same bytes under the same name get what is there
  void RequireFree() const;  // throws Conflict when the name is taken
  void Write(std::span<const char> bytes) {
    blob_.Write(bytes);
    room_.Wrote(bytes.size());
  }
  // `also` runs in the transaction that records the upload.
  using Also = std::function<void(const Answer&)>;
  Answer Finish(const Also& also = {});

 private:
  enum class Kind { kScan, kBones, kStrokes };
  Upload(Services& services, Kind kind, std::string subject, std::string name, UploadFormat format,
         const Query& query, std::string key, std::optional<IncomingBlob> received);
  RequestKey KeyOfRequest(const std::string& sha256) const;
  Answer Record(const StoredFile& file);
  void RequireOnTemplate(const Grid& labels) const;
  void RequireStrokes(const LabelFacts& facts) const;
  std::optional<Answer> SameAgain(const std::string& sha256) const;
  std::optional<StoredFile> Known(const std::string& sha256) const;
  bool IsDamaged(const StoredFile& file) const;
  bool Empty() const { return blob_.bytes() == 0; }
  std::string CloseAndCheck();
  StoredFile Inspect();
  std::string Keep();
  std::optional<Answer> KeepAndRecord(const RequestKey& key, StoredFile& file, const Also& also);
  void PrepareStrokes(const StoredFile& file, const std::filesystem::path& at);

  Services& services_;
  Kind kind_;
  std::string subject_, name_;  // of the scan, or of the template that the bones belong to
  std::string previous_;        // of strokes: id of the label map that fewer of them gave
  UploadFormat format_;
  std::string announced_sha256_;  // empty: none
  std::string idempotency_key_;
  bool same_again_is_fine_ = false;
  PreparedSegmentation segmentation_;  // of strokes
  IncomingBlob blob_;
  std::optional<IncomingFolder> folder_;  // what an archive holds, once it was inspected
  RoomWatch room_{services_};
};

}  // namespace kvx
