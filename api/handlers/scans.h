// Scans of a subject that are there; subject_uploads.h takes new ones.
#pragma once
#include "api/request.h"
#include "api/services.h"

namespace kvx {

std::string ListScans(Services& services, const std::string& subject, const Query& query);
// Throws NotFound for a scan of another subject, too.
std::string GetScan(Services& services, const std::string& subject, const std::string& id_or_name);

}  // namespace kvx
