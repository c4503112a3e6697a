// Posed volumes and posed points of a built model.
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

struct PointsAnswer {
  std::string content_type, body;
};

// Template points to the pose; CSV (header x,y,z, further columns carried through) or {"points":
// [[x,y,z], ...], "pose"?}.
PointsAnswer MapPoints(Services& services, const std::string& model, const Query& query,
                       const std::string& content_type, const std::string& accept, const std::string& body);

}  // namespace kvx
