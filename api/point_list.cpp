// A request holds its points in memory: there is a most.
#include "api/point_list.h"

#include <nlohmann/json.hpp>

#include "api/request.h"
#include "core/errors.h"

namespace kvx {
namespace {

constexpr size_t kMostPoints = 2'000'000;
// A list of three numbers for each point, and a pose beside them.
constexpr JsonLimits kPointLimits{
    .values = 4 * kMostPoints + 100'000, .lists = kMostPoints + 10'000, .keys = 100'000};

void RequireAtMost(size_t count) {
  if (count > kMostPoints)
    throw InputError("there are more points than one request may hold; send them in parts");
}

}  // namespace

PointList PointsOfCsv(std::string_view text) {
  PointList list{ParsePoints(text), {}};
  RequireAtMost(list.table.points.size());
  return list;
}

PointList PointsOfJson(std::string_view text) {
  const Json json = ParseBody(text, kPointLimits);
  RequireFields(json, {"points", "pose"}, "the body");
  const auto points = json.find("points");
  if (points == json.end() || !points->is_array())
    throw InputError("'points' is a list of [x, y, z] in LPS mm");
  RequireAtMost(points->size());
  PointList list;
  for (const Json& item : *points) {
    if (!item.is_array() || item.size() != 3) throw InputError("each of 'points' is [x, y, z] in LPS mm");
    PointMm point;
    for (int axis = 0; axis < 3; ++axis) {
      if (!item[size_t(axis)].is_number()) throw InputError("each of 'points' is three numbers");
      point.lps[axis] = item[size_t(axis)].get<double>();
    }
    list.table.points.push_back(point);
    list.table.extra.emplace_back();
  }
  if (json.contains("pose")) list.pose = json["pose"].dump();
  return list;
}

std::string JsonOfPoints(const std::vector<PointMm>& points) {
  Json list = Json::array();
  for (const PointMm& p : points) list.push_back({p.lps.x(), p.lps.y(), p.lps.z()});
  return Dump(Json{{"points", std::move(list)}});
}

}  // namespace kvx
