// The answer has the form of the request, unless the client asks for the other one.
#include "api/handlers/posed_points.h"

#include "api/handlers/pose_query.h"

namespace kvx {

AskedPoints ReadPoints(Services& services, const std::string& model, const Query& query,
                       const std::string& content_type, const std::string& body) {
  services.catalogue.RequireModel(model);  // before much is made of the body
  AskedPoints points;
  points.json = content_type.find("json") != std::string::npos;
  points.list = points.json ? PointsOfJson(body) : PointsOfCsv(body);
  points.posed = PosedQueryOf(services, model, query, {"mode"}, points.list.pose);
  RequireBuilt(services, model);
  return points;
}

void PosePoints(Services& services, AskedPoints& points) {
  ReplacePoints(points.list.table.points,
                [&](const auto& placed) { return services.poser.MapPoints(points.posed, placed); });
}

PointsAnswer WritePoints(const AskedPoints& points, const std::string& accept) {
  const bool wants_json = accept.find("application/json") != std::string::npos;
  const bool wants_csv = accept.find("text/csv") != std::string::npos;
  if (wants_json || (points.json && !wants_csv))
    return {"application/json", JsonOfPoints(points.list.table.points)};
  return {"text/csv; charset=utf-8", FormatPoints(points.list.table)};
}

}  // namespace kvx
