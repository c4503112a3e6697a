// /v1/uploads: resumable uploads of scans and bones, tus 1.0 (https://tus.io) with the extensions below.
#pragma once
#include <span>

#include "api/handlers/subject_uploads.h"
#include "storage/resumable_uploads.h"

namespace kvx {

constexpr char kTusVersion[] = "1.0.0";
constexpr char kTusExtensions[] = "creation,creation-with-upload,expiration,checksum,termination";
constexpr char kTusChecksums[] = "sha1,sha256,md5";

// One of this project; throws NotFound, or Gone when it has expired.
ResumableUpload RequireResumableUpload(Services& services, const std::string& id);

// POST /v1/uploads with Upload-Length and Upload-Metadata: filename, subject, name or template, and as one
// likes kind (scan, bones, or seeds: strokes) and sha256. All of it is checked now, as far as that goes
// without the bytes.
ResumableUpload CreateResumableUpload(Services& services, const std::string& length,
                                      const std::string& metadata);

// PATCH /v1/uploads/{id}: bytes from the offset on. Bytes that came before a connection broke are kept,
// unless a checksum was announced: then all or none.
// The last byte makes the upload a scan or bones, or refuses it and removes it.
class ResumablePart {
 public:
  ResumablePart(Services& services, const std::string& id, const std::string& offset,
                const std::string& checksum);
  ~ResumablePart();
  void Write(std::span<const char> bytes);
  void BrokeOff();  // instead of Finish; what came is kept
  ResumableUpload Finish();

 private:
  void StoreWhole();
  struct Checksum;
  Services& services_;
  std::unique_ptr<ResumableUploads::Writer> writer_;
  std::unique_ptr<Checksum> checksum_;
  int64_t kept_ = 0;
  RoomWatch room_{services_};
};

// GET /v1/uploads/{id}, for people: tus clients ask by HEAD.
std::string GetResumableUpload(Services& services, const std::string& id);

}  // namespace kvx
