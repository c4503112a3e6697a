// GET /v1/subjects/{s}/scans and .../scans/{scan}
#include "api/handlers/scans.h"

#include <nlohmann/json.hpp>

#include "api/views.h"
#include "core/errors.h"
#include "storage/ids.h"

namespace kvx {

std::string ListScans(Services& services, const std::string& subject, const Query& query) {
  const PageRequest page = ParsePage(query);
  services.catalogue.RequireSubject(subject);
  return Dump(PageView(services.catalogue.Scans(subject, page)));
}

std::string GetScan(Services& services, const std::string& subject, const std::string& id_or_name) {
  const auto scan = LooksLikeId(id_or_name, "scn") ? std::optional(services.catalogue.RequireScan(id_or_name))
                                                   : services.catalogue.FindScan(subject, id_or_name);
  if (!scan || scan->subject != subject) throw NotFound("the subject has no such scan");
  return Dump(View(*scan));
}

}  // namespace kvx
