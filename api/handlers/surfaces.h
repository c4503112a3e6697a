// Posed surfaces of a built model.
#pragma once
#include "api/handlers/pose_query.h"

namespace kvx {

// Query: the pose as for volumes; bone=NAME,NAME; skin=true|false; format=glb|stl.
FileAnswer GetSurface(Services& services, const std::string& model, const Query& query,
                      const std::string& pose, const Conditions& conditions);

}  // namespace kvx
