// GET /v1/subjects/{s}/scans, .../scans/{scan} and .../scans/{scan}/volume
#include "api/handlers/scans.h"

#include <nlohmann/json.hpp>

#include "api/handlers/stored_volumes.h"
#include "api/views.h"
#include "core/errors.h"
#include "storage/ids.h"

namespace kvx {
namespace {

ScanRecord RequireScanCalled(Services& services, const std::string& subject, const std::string& id_or_name) {
  const auto scan = LooksLikeId(id_or_name, "scn") ? std::optional(services.catalogue.RequireScan(id_or_name))
                                                   : services.catalogue.FindScan(subject, id_or_name);
  if (!scan || scan->subject != subject) throw NotFound("the subject has no such scan");
  return *scan;
}

}  // namespace

std::string ListScans(Services& services, const std::string& subject, const Query& query) {
  const PageRequest page = ParsePage(query);
  services.catalogue.RequireSubject(subject);
  return Dump(PageView(services.catalogue.Scans(subject, page)));
}

std::string GetScan(Services& services, const std::string& subject, const std::string& id_or_name) {
  return Dump(View(RequireScanCalled(services, subject, id_or_name)));
}

FileAnswer GetScanVolume(Services& services, const std::string& subject, const std::string& id_or_name,
                         const Query& query, const Conditions& conditions) {
  RequireKnown(query, {"format"});
  const std::string format = FormatAmong(query, {"nii.gz", "nii", "nrrd", "mha", "raw"}, "a scan");
  const ScanRecord scan = RequireScanCalled(services, subject, id_or_name);
  const auto convert = [&](const StudyFile& stored, const std::filesystem::path& out) {
    services.builder.ConvertScan(stored, out);
  };
  FileAnswer answer = AnswerWithStored(services, scan.file, {scan.id, format}, conditions, convert);
  if (format == "raw" && !answer.not_modified) TellGeometry(answer);
  return answer;
}

}  // namespace kvx
