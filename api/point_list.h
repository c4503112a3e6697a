// Points in LPS mm as CSV and JSON, both ways; what follows x,y,z on a CSV row is carried through untouched.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "core/frames.h"

namespace kvx {

struct PointList {
  std::vector<PointMm> points;
  std::string more_columns;              // of the CSV header, with its leading comma
  std::vector<std::string> more_values;  // one per point, or none at all
  std::string pose;                      // JSON of a pose that came with the points
};

PointList PointsOfCsv(std::string_view text);  // throws InputError naming the line
PointList PointsOfJson(std::string_view text);
std::string CsvOfPoints(const PointList& list);
std::string JsonOfPoints(const PointList& list);

}  // namespace kvx
