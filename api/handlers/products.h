// Slices, surfaces and animations of a built model.
#pragma once
#include "api/handlers/pose_query.h"

namespace kvx {

// Query: the pose as for volumes; axis and mm, or centre, right and down; projection, slab_mm, width_mm,
// height_mm, pixel_mm, window, format=png|nii.gz|nrrd. `pose` is the body of a POST, empty for GET.
FileAnswer GetSlice(Services& services, const std::string& model, const Query& query, const std::string& pose,
                    const Conditions& conditions);

// Query: the pose as for volumes; bone=NAME,NAME; skin=true|false; format=glb|stl.
FileAnswer GetSurface(Services& services, const std::string& model, const Query& query,
                      const std::string& pose, const Conditions& conditions);

// Body: key frames. Query: mode, level, format and, for videos, a slice's parameters.
// 202 with the job that makes it.
Answer CreateAnimation(Services& services, const std::string& model, const Query& query,
                       const std::string& body, const std::string& idempotency_key);
// The file that a job of kind `animation` made.
FileAnswer GetAnimation(Services& services, const std::string& model, const std::string& job,
                        const Conditions& conditions);

// The worker's side.
std::string MakeAnimation(Services& services, const ClaimedJob& job,
                          const Progress& progress);  // the job's result

}  // namespace kvx
