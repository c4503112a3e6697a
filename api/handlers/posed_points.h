// Posed points of a built model.
#pragma once
#include "api/point_list.h"
#include "api/request.h"
#include "api/services.h"

namespace kvx {

struct AskedPoints {
  PointList list;
  PosedQuery posed;
  bool json = false;  // as they came
};
struct PointsAnswer {
  std::string content_type, body;
};

// Template points to the pose; CSV (header x,y,z, further columns carried through) or {"points":
// [[x,y,z], ...], "pose"?}.
AskedPoints ReadPoints(Services& services, const std::string& model, const Query& query,
                       const std::string& content_type, const std::string& body);
void PosePoints(Services& services, AskedPoints& points);
PointsAnswer WritePoints(const AskedPoints& points, const std::string& accept);

}  // namespace kvx
