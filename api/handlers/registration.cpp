// Made when first asked for, then a kept file like any product.
#include "api/handlers/registration.h"

#include "core/errors.h"

namespace kvx {
namespace {

RegistrationMap MapCalled(const std::string& name) {
  if (name == "scan_from_template") return RegistrationMap::kScanFromTemplate;
  if (name == "template_from_scan") return RegistrationMap::kTemplateFromScan;
  if (name == "confidence") return RegistrationMap::kConfidence;
  if (name == "error") return RegistrationMap::kError;
  throw InputError("'map' is scan_from_template, template_from_scan, confidence or error");
}

}  // namespace

FileAnswer GetRegistration(Services& services, const std::string& model, const Query& query,
                           const Conditions& conditions) {
  RequireKnown(query, {"scan", "map", "format"});
  const std::string map_name = QueryValue(query, "map", "scan_from_template");
  const RegistrationMap map = MapCalled(map_name);
  const std::string format = FormatAmong(query, {"nii.gz", "nrrd", "mha"}, "a registration"),
                    scan = QueryValue(query, "scan");
  if (scan.empty()) throw InputError("'scan' is missing; name one of the model's scans");
  RequireBuilt(services, model);
  PosedQuery of_scan;
  of_scan.model = model, of_scan.pose = ScanPose{scan};
  const PoseFacts facts = services.poser.FactsOf(of_scan);
  const Digest digest =
      Hasher().Add("registration").Add(facts.digest).Add(scan).Add(int64_t(map)).Add(format).Finish();
  const char* type = format == "nii.gz" ? "application/gzip" : "application/octet-stream";
  const std::string filename = PosedFileName(model, digest, map_name + "." + format);  // no name of a user's
  FileAnswer answer = AnswerWith(digest, conditions, type, filename, [&] {
    const Asker asker = services.asker();
    const auto write = [&](const std::filesystem::path& path) {
      services.poser.WriteRegistration(model, scan, map, path, asker);
    };
    return services.results.Get(model + "." + digest.Hex() + "." + format, write, asker);
  });
  return ToldOfScan(std::move(answer), facts);
}

}  // namespace kvx
