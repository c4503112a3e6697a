// Animations of a built model: jobs whose file is kept among the results.
#pragma once
#include "api/handlers/pose_query.h"

namespace kvx {

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
