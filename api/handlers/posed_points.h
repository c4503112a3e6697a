// Posed points of a built model.
#pragma once
#include "api/request.h"
#include "api/services.h"

namespace kvx {

struct PointsAnswer {
  std::string content_type, body;
};

// Template points to the pose; CSV (header x,y,z, further columns carried through) or {"points":
// [[x,y,z], ...], "pose"?}.
PointsAnswer MapPoints(Services& services, const std::string& model, const Query& query,
                       const std::string& content_type, const std::string& accept, const std::string& body);

}  // namespace kvx
