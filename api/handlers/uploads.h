// Scans and bones on their way in: checked before the first byte, streamed, read once, then kept. Refused ones leave nothing.
#pragma once
#include <span>

#include "api/request.h"
#include "api/services.h"

namespace kvx {

// What the uploaded file is, by the end of its name; the rest of the name is not looked at.
struct UploadFormat {
  std::string suffix;     // ".nii.gz"; for archives ".zip", ".tar", ".tar.gz"
  bool archive = false;
};
UploadFormat FormatOfUpload(const std::string& filename);  // throws InputError

// POST /v1/subjects/{s}/scans?name=pose00&filename=pose00.nii.gz, or .../bones?template=pose00&filename=...
class Upload {
 public:
  static Upload OfScan(Services& services, const std::string& subject, const Query& query,
                       const std::string& idempotency_key);
  static Upload OfBones(Services& services, const std::string& subject, const Query& query,
                        const std::string& idempotency_key);

  void Write(std::span<const char> bytes) { blob_.Write(bytes); }
  Answer Finish();

 private:
  enum class Kind { kScan, kBones };
  Upload(Services& services, Kind kind, std::string subject, std::string name, UploadFormat format, std::string key);
  Answer Record(const StoredFile& file);
  void RequireFree() const;
  StoredFile InspectAndKeep();

  Services& services_;
  Kind kind_;
  std::string subject_, name_;  // of the scan, or of the template that the bones belong to
  UploadFormat format_;
  std::string idempotency_key_;
  IncomingBlob blob_;
};

std::string ListScans(Services& services, const std::string& subject, const Query& query);
std::string GetScan(Services& services, const std::string& subject, const std::string& id);
std::string GetBones(Services& services, const std::string& subject, const std::string& id);

}  // namespace kvx
