// What the registration of a model's scans found, voxel by voxel.
#pragma once
#include "api/handlers/pose_query.h"

namespace kvx {

// Query: scan=NAME; map=scan_from_template|template_from_scan|confidence|error; format=nii.gz|nrrd|mha.
FileAnswer GetRegistration(Services& services, const std::string& model, const Query& query,
                           const Conditions& conditions);

}  // namespace kvx
