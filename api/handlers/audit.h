// GET /v1/audit: the project's entries of the audit trail, newest first.
#pragma once
#include "api/request.h"
#include "api/services.h"

namespace kvx {

std::string ListAudit(Services& services, const Query& query);

}  // namespace kvx
