// CSV by hand: three numbers per record, the rest of the record kept verbatim (quotes and all).
#include "core/points_csv.h"

#include <charconv>
#include <cmath>

#include "core/errors.h"

namespace kvx {
namespace {

std::string_view Trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == text.npos) return {};
  text = text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"') text = text.substr(1, text.size() - 2);
  return text;
}

// Cuts the next record off `rest`: up to a line feed that is not inside quotes.
std::string_view NextRecord(std::string_view& rest) {
  size_t end = 0;
  for (bool quoted = false; end < rest.size() && (quoted || rest[end] != '\n'); ++end)
    quoted ^= rest[end] == '"';
  std::string_view record = rest.substr(0, end);
  rest.remove_prefix(std::min(rest.size(), end + 1));
  if (record.ends_with('\r')) record.remove_suffix(1);
  return record;
}

// Cuts the next field off `record`, its comma left in place.
std::string_view NextField(std::string_view& record) {
  const size_t end = std::min(record.find(','), record.size());
  const std::string_view field = record.substr(0, end);
  record.remove_prefix(end);
  return Trimmed(field);
}

[[noreturn]] void ThrowNotNumbers(size_t line) {
  throw InputError("points file, line " + std::to_string(line) + ": x, y and z must be numbers (LPS mm)");
}

double Number(std::string_view text, size_t line) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty() || std::isinf(value)) {
    ThrowNotNumbers(line);
  }
  return value;
}

std::string_view HeaderExtra(std::string_view record) {
  for (const char* name : {"x", "y", "z"}) {
    if (NextField(record) != name)
      throw InputError("the points file must begin with the header line x,y,z (LPS mm)");
    if (*name != 'z' && record.starts_with(',')) record.remove_prefix(1);
  }
  return record;
}

void AddRow(std::string_view record, size_t line, PointTable& table) {
  PointMm point;
  for (int axis = 0; axis < 3; ++axis) {
    point.lps[axis] = Number(NextField(record), line);
    if (axis < 2 && record.starts_with(',')) record.remove_prefix(1);
  }
  if (point.lps.array().isNaN().any() && !point.lps.array().isNaN().all()) ThrowNotNumbers(line);
  table.points.push_back(point);
  table.extra.emplace_back(record);
}

void AppendNumber(std::string& out, double value) {
  char text[32];
  out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

}  // namespace

PointTable ParsePoints(std::string_view csv) {
  if (csv.starts_with("\xEF\xBB\xBF")) csv.remove_prefix(3);  // byte order mark of spreadsheet programs
  PointTable table;
  table.extra_header = HeaderExtra(NextRecord(csv));
  for (size_t line = 2; !csv.empty(); ++line) {
    const std::string_view record = NextRecord(csv);
    if (!Trimmed(record).empty()) AddRow(record, line, table);
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
