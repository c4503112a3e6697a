// Points in LPS mm as they come and go in requests: CSV (core/text/points_csv.h) or JSON.
#pragma once
#include <string>
#include <string_view>

#include "core/text/points_csv.h"

namespace kvx {

struct PointList {
  PointTable table;  // without further columns when they came as JSON
  std::string pose;  // JSON of a pose that came with the points
};

// Throw InputError for what is wrong, and for more points than one request may hold.
PointList PointsOfCsv(std::string_view text);
PointList PointsOfJson(std::string_view text);

std::string JsonOfPoints(const std::vector<PointMm>& points);

}  // namespace kvx
