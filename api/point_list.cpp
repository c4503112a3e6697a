// Numbers are written so that reading them gives the same double.
#include "api/point_list.h"

#include <charconv>
#include <nlohmann/json.hpp>

#include "api/request.h"
#include "core/errors.h"

namespace kvx {
namespace {

constexpr size_t kMostPoints = 2'000'000;

std::string_view TakeLine(std::string_view& text) {
  const size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

// Cuts the first field off; `line` keeps the comma that follows it.
std::string_view TakeField(std::string_view& line) {
  if (line.starts_with(',')) line.remove_prefix(1);
  const size_t end = std::min(line.find(','), line.size());
  std::string_view field = line.substr(0, end);
  line.remove_prefix(end);
  while (field.starts_with(' ')) field.remove_prefix(1);
  while (field.ends_with(' ')) field.remove_suffix(1);
  return field;
}

void AddNumber(std::string& text, double value) {
  char buffer[32];
  text.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

void RequireRoom(size_t count) {
  if (count >= kMostPoints)
    throw InputError("there are more points than one request may hold; send them in parts");
}

}  // namespace

PointList PointsOfCsv(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  PointList list;
  std::string_view header = TakeLine(text);
  for (const char* name : {"x", "y", "z"}) {
    if (TakeField(header) != name) throw InputError("the CSV starts with the header x,y,z (LPS mm)");
  }
  list.more_columns = header;
  for (int line_number = 2; !text.empty(); ++line_number) {
    std::string_view line = TakeLine(text);
    if (line.empty()) continue;
    RequireRoom(list.points.size());
    const std::string where = "line " + std::to_string(line_number) + " of the CSV: a coordinate";
    PointMm point;
    for (int axis = 0; axis < 3; ++axis) point.lps[axis] = ParseNumber(TakeField(line), where);
    list.points.push_back(point);
    list.more_values.emplace_back(line);
  }
  return list;
}

PointList PointsOfJson(std::string_view text) {
  const Json json = ParseObject(text);
  RequireFields(json, {"points", "pose"}, "the body");
  const auto points = json.find("points");
  if (points == json.end() || !points->is_array())
    throw InputError("'points' is a list of [x, y, z] in LPS mm");
  PointList list;
  for (const Json& item : *points) {
    RequireRoom(list.points.size());
    if (!item.is_array() || item.size() != 3) throw InputError("each of 'points' is [x, y, z] in LPS mm");
    PointMm point;
    for (int axis = 0; axis < 3; ++axis) {
      if (!item[size_t(axis)].is_number()) throw InputError("each of 'points' is three numbers");
      point.lps[axis] = item[size_t(axis)].get<double>();
    }
    list.points.push_back(point);
  }
  if (json.contains("pose")) list.pose = json["pose"].dump();
  return list;
}

std::string CsvOfPoints(const PointList& list) {
  std::string text = "x,y,z" + list.more_columns + "\n";
  for (size_t i = 0; i < list.points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      if (axis > 0) text += ',';
      AddNumber(text, list.points[i].lps[axis]);
    }
    if (i < list.more_values.size()) text += list.more_values[i];
    text += '\n';
  }
  return text;
}

std::string JsonOfPoints(const PointList& list) {
  Json points = Json::array();
  for (const PointMm& p : list.points) points.push_back({p.lps.x(), p.lps.y(), p.lps.z()});
  return Dump(Json{{"points", std::move(points)}});
}

}  // namespace kvx
