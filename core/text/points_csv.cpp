// CSV by hand: three numbers per record, the further fields kept as they stand (quotes and all).
#include "core/text/points_csv.h"

#include <charconv>
#include <cmath>
#include <optional>

#include "core/errors.h"
#include "core/farthest_place.h"
#include "core/text/csv_reader.h"
#include "core/text/lower_case.h"
#include "core/text/parse_number.h"

namespace kvx {
namespace {

constexpr const char* kNotNumbers = "x, y and z must be numbers (LPS mm)";
constexpr const char* kTooFar = "the point is more than a kilometre away; its numbers are in mm";
double Number(const CsvReader& reader, std::string_view field, size_t line) {
  const std::string text = reader.NumberText(field, line);
  const std::optional<double> value = ParseAs<double>(text);
  if (!value || std::isinf(*value)) reader.ThrowAt(line, kNotNumbers);
  return *value;
}

// The columns behind the first three, each after a comma.
std::string ExtraOf(const CsvRecord& record, char separator) {
  std::string extra;
  for (size_t column = 3; column < record.size(); ++column) {
    const std::string_view field = record[column];
    const bool bare_comma = separator != ',' && !field.starts_with('"') && field.find(',') != field.npos;
    extra += ',';
    if (!bare_comma) {
      extra += field;
      continue;
    }
    extra += '"';
    for (const char c : field) extra.append(c == '"' ? 2 : 1, c);
    extra += '"';
  }
  return extra;
}

void RequireHeader(const CsvRecord& record) {
  for (const size_t column : {0, 1, 2}) {
    const bool there = column < record.size();
    if (!there || LowerCase(std::string(CsvText(record[column]))) != std::string(1, char('x' + column)))
      throw InputError(
          "the points file must begin with the header line x,y,z (LPS mm; commas, semicolons or tabs between "
          "columns)");
  }
}

void AddRow(const CsvReader& reader, const CsvRecord& record, size_t line, PointTable& table) {
  PointMm point;
  if (record.size() < 3) reader.ThrowAt(line, kNotNumbers);
  for (int axis = 0; axis < 3; ++axis) point.lps[axis] = Number(reader, record[size_t(axis)], line);
  if (point.lps.array().isNaN().any() && !point.lps.array().isNaN().all()) reader.ThrowAt(line, kNotNumbers);
  if (LiesTooFar(point)) reader.ThrowAt(line, kTooFar);
  table.points.push_back(point);
  table.extra.push_back(ExtraOf(record, reader.separator()));
}

void AppendNumber(std::string& out, double value) {
  char text[32];
  out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

}  // namespace

PointTable ParsePoints(std::string_view csv) {
  CsvReader reader(csv, "points file");
  const CsvRecord header = reader.Next();
  RequireHeader(header);
  PointTable table;
  table.extra_header = ExtraOf(header, reader.separator());
  while (!reader.AtEnd()) {
    const size_t line = reader.line();
    const CsvRecord record = reader.Next();
    if (record.size() == 1 && CsvText(record.front()).empty()) continue;
    AddRow(reader, record, line, table);
    reader.RequireNoMoreColumns(record, header.size(), line);
  }
  return table;
}

std::string FormatPoints(const PointTable& table) {
  std::string out = "x,y,z" + table.extra_header + "\n";
  for (size_t i = 0; i < table.points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      if (axis) out += ',';
      AppendNumber(out, table.points[i].lps[axis]);
    }
    out += table.extra[i];
    out += '\n';
  }
  return out;
}

}  // namespace kvx
