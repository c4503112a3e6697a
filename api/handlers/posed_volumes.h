// Posed volumes of a built model, and the coarse field of a pose.
#pragma once
#include "api/handlers/pose_query.h"

namespace kvx {

// Query: any bone.dof=degrees, or scan=NAME; mode, level, format. `pose` is the body of a POST, empty for
// GET. raw and nii are sent in the content coding that the client prefers.
FileAnswer GetVolume(Services& services, const std::string& model, const Query& query,
                     const std::string& pose, const Conditions& conditions);

// The coarse displacement from a pose back to the template, as raw floats; its errors are in the headers.
// Query: the pose as for volumes; mode; level, 2 when left out.
FileAnswer GetField(Services& services, const std::string& model, const Query& query, const std::string& pose,
                    const Conditions& conditions);

}  // namespace kvx
