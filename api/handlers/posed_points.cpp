// The answer has the form of the request, unless the client asks for the other one.
#include "api/handlers/posed_points.h"

#include "api/handlers/pose_query.h"
#include "api/point_list.h"

namespace kvx {

PointsAnswer MapPoints(Services& services, const std::string& model, const Query& query,
                       const std::string& content_type, const std::string& accept, const std::string& body) {
  services.catalogue.RequireModel(model);  // before much is made of the body
  const bool json = content_type.find("json") != std::string::npos;
  PointList list = json ? PointsOfJson(body) : PointsOfCsv(body);
  const PosedQuery posed = PosedQueryOf(services, model, query, {"mode"}, list.pose);
  RequireBuilt(services, model);
  ReplacePoints(list.table.points,
                [&](const auto& points) { return services.poser.MapPoints(posed, points); });
  const bool wants_json = accept.find("application/json") != std::string::npos;
  const bool wants_csv = accept.find("text/csv") != std::string::npos;
  if (wants_json || (json && !wants_csv)) return {"application/json", JsonOfPoints(list.table.points)};
  return {"text/csv; charset=utf-8", FormatPoints(list.table)};
}

}  // namespace kvx
