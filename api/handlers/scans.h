// Scans of a subject that are there; subject_uploads.h takes new ones.
#pragma once
#include "api/handlers/pose_query.h"

namespace kvx {

std::string ListScans(Services& services, const std::string& subject, const Query& query);
// Throws NotFound for a scan of another subject, too.
std::string GetScan(Services& services, const std::string& subject, const std::string& id_or_name);
// The scan itself. Query: format=nii.gz|nii|nrrd|mha|raw; the geometry of a raw one is in headers.
FileAnswer GetScanVolume(Services& services, const std::string& subject, const std::string& id_or_name,
                         const Query& query, const Conditions& conditions);

}  // namespace kvx
