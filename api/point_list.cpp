// A request holds its points in memory: there is a most.
#include "api/point_list.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "api/request.h"
#include "core/errors.h"
#include "core/farthest_place.h"

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

// Three numbers, or three nulls as JsonOfPoints writes a point that is nowhere.
PointMm PointOf(const Json& item) {
  if (!item.is_array() || item.size() != 3) throw InputError("each of 'points' is [x, y, z] in LPS mm");
  PointMm point;
  if (std::ranges::all_of(item, [](const Json& value) { return value.is_null(); })) {
    point.lps.setConstant(std::numeric_limits<double>::quiet_NaN());
    return point;
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!item[size_t(axis)].is_number())
      throw InputError("each of 'points' is three numbers, or three nulls");
    point.lps[axis] = item[size_t(axis)].get<double>();
  }
  if (LiesTooFar(point))
    throw InputError("one of 'points' is more than a kilometre away; their numbers are in mm");
  return point;
}

}  // namespace

PointList PointsOfCsv(std::string_view text) {
  if (text.substr(0, text.find_first_not_of(" \t\r\n") + 1).ends_with('{')) {
    throw InputError("the points are JSON but were not called so; send Content-Type: application/json");
  }
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
    list.table.points.push_back(PointOf(item));
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
