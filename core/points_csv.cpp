// CSV by hand: three numbers per record, the further fields kept as they stand (quotes and all).
#include "core/points_csv.h"

#include <charconv>
#include <cmath>

#include "core/errors.h"
#include "core/lower_case.h"

namespace kvx {
namespace {

std::string_view Trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == text.npos) return {};
  text = text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"') text = text.substr(1, text.size() - 2);
  return text;
}

[[noreturn]] void ThrowAt(size_t line, const std::string& what) {
  throw InputError("points file, line " + std::to_string(line) + ": " + what);
}

using Record = std::vector<std::string_view>;  // fields as they stand in the file, quotes and all

// Records of RFC 4180: a quote opens a field only where the field begins. Lines may end in CR alone.
class RecordReader {
 public:
  RecordReader(std::string_view text, char separator) : rest_(text), separator_(separator) {}

  bool AtEnd() const { return rest_.empty(); }
  size_t line() const { return line_; }  // on which the next record begins, from 1
  char separator() const { return separator_; }

  Record Next() {
    Record fields;
    while (true) {
      const size_t length = FieldLength();
      fields.push_back(rest_.substr(0, length));
      CountLines(fields.back());
      rest_.remove_prefix(length);
      if (rest_.empty()) return fields;
      const char after = rest_.front();
      rest_.remove_prefix(1);
      if (after == separator_) continue;
      if (after == '\r' && rest_.starts_with('\n')) rest_.remove_prefix(1);
      ++line_;
      return fields;
    }
  }

 private:
  size_t FieldLength() const {
    const size_t behind_quotes = rest_.starts_with('"') ? QuotedLength() : 0;
    const char ends[] = {separator_, '\n', '\r'};
    return std::min(rest_.find_first_of({ends, sizeof ends}, behind_quotes), rest_.size());
  }

  size_t QuotedLength() const {
    for (size_t quote = rest_.find('"', 1); quote != rest_.npos; quote = rest_.find('"', quote + 2)) {
      if (quote + 1 == rest_.size() || rest_[quote + 1] != '"') return quote + 1;
    }
    ThrowAt(line_, "a field begins with a quote that is never closed; write a quote inside a field as \"\"");
  }

  void CountLines(std::string_view field) {
    for (size_t i = 0; i < field.size(); ++i)
      line_ += field[i] == '\n' || (field[i] == '\r' && (i + 1 == field.size() || field[i + 1] != '\n'));
  }

  std::string_view rest_;
  char separator_;
  size_t line_ = 1;
};

constexpr const char* kNotNumbers = "x, y and z must be numbers (LPS mm)";
constexpr std::string_view kSeparators = ",;\t";

void RequirePlainText(std::string_view csv) {
  const bool wide = csv.starts_with("\xFF\xFE") || csv.starts_with("\xFE\xFF");
  if (wide || csv.find('\0') != csv.npos)
    throw InputError(
        "the points file is not plain text (UTF-16, or a workbook?); save it as CSV, in UTF-8 where there "
        "is a choice");
}

// By what stands first in the file; a line `sep=;`, which is there for Excel, is passed over.
RecordReader ReaderOf(std::string_view csv) {
  const bool told = csv.size() > 4 && LowerCase(std::string(csv.substr(0, 4))) == "sep=";
  const size_t first = told ? 4 : std::min(csv.find_first_of(",;\t\n\r"), csv.size());
  const bool known = first < csv.size() && kSeparators.find(csv[first]) != kSeparators.npos;
  RecordReader reader(csv, known ? csv[first] : ',');
  if (told) reader.Next();
  return reader;
}

double Number(std::string_view field, char separator, size_t line) {
  std::string text(Trimmed(field));
  const size_t comma = text.find(',');
  if (comma != text.npos && separator == ',')
    ThrowAt(line,
            "a number has a decimal comma; write decimal points, or separate the columns by semicolons");
  if (comma != text.npos) text[comma] = '.';
  if (text.starts_with('+')) text.erase(0, 1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || std::isinf(value))
    ThrowAt(line, kNotNumbers);
  return value;
}

// The columns behind the first three, each after a comma.
std::string ExtraOf(const Record& record, char separator) {
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

void RequireHeader(const Record& record) {
  for (const size_t column : {0, 1, 2}) {
    const bool there = column < record.size();
    if (!there || LowerCase(std::string(Trimmed(record[column]))) != std::string(1, char('x' + column)))
      throw InputError(
          "the points file must begin with the header line x,y,z (LPS mm; commas, semicolons or tabs between "
          "columns)");
  }
}

void AddRow(const Record& record, char separator, size_t line, PointTable& table) {
  PointMm point;
  if (record.size() < 3) ThrowAt(line, kNotNumbers);
  for (int axis = 0; axis < 3; ++axis) point.lps[axis] = Number(record[size_t(axis)], separator, line);
  if (point.lps.array().isNaN().any() && !point.lps.array().isNaN().all()) ThrowAt(line, kNotNumbers);
  table.points.push_back(point);
  table.extra.push_back(ExtraOf(record, separator));
}

// Decimal commas between commas would be read as columns.
void RequireNoMoreColumns(const Record& record, size_t columns, size_t line) {
  for (size_t column = columns; column < record.size(); ++column) {
    if (!Trimmed(record[column]).empty())
      ThrowAt(line,
              "there are more columns than in the header; are there decimal commas? Write decimal points, or "
              "separate the columns by semicolons");
  }
}

void AppendNumber(std::string& out, double value) {
  char text[32];
  out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

}  // namespace

PointTable ParsePoints(std::string_view csv) {
  if (csv.starts_with("\xEF\xBB\xBF")) csv.remove_prefix(3);  // byte order mark of spreadsheet programs
  RequirePlainText(csv);
  RecordReader reader = ReaderOf(csv);
  const Record header = reader.Next();
  RequireHeader(header);
  PointTable table;
  table.extra_header = ExtraOf(header, reader.separator());
  while (!reader.AtEnd()) {
    const size_t line = reader.line();
    const Record record = reader.Next();
    if (record.size() == 1 && Trimmed(record.front()).empty()) continue;
    AddRow(record, reader.separator(), line, table);
    RequireNoMoreColumns(record, header.size(), line);
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
