// The chain's hashes are for `kinevox audit verify`, which sees all projects.
#include "api/handlers/audit.h"

#include <nlohmann/json.hpp>

#include "api/views.h"

namespace kvx {

std::string ListAudit(Services& services, const Query& query) {
  return Dump(PageView(services.audit.List(ParsePage(query))));
}

}  // namespace kvx
