// A quote opens a field only where the field begins. What stands first in the file tells the separator.
#include "core/text/csv_reader.h"

#include <algorithm>

#include "core/errors.h"
#include "core/text/lower_case.h"

namespace kvx {
namespace {

constexpr std::string_view kSeparators = ",;\t";

}  // namespace

std::string_view CsvText(std::string_view field) {
  const auto first = field.find_first_not_of(" \t\r");
  if (first == field.npos) return {};
  field = field.substr(first, field.find_last_not_of(" \t\r") - first + 1);
  if (field.size() >= 2 && field.front() == '"' && field.back() == '"')
    field = field.substr(1, field.size() - 2);
  return field;
}

CsvReader::CsvReader(std::string_view text, std::string name) : rest_(text), name_(std::move(name)) {
  if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);  // byte order mark of spreadsheet programs
  const bool wide = rest_.starts_with("\xFF\xFE") || rest_.starts_with("\xFE\xFF");
  if (wide || rest_.find('\0') != rest_.npos)
    throw InputError("the " + name_ +
                     " is not plain text (UTF-16, or a workbook?); save it as CSV, in UTF-8 where there is a "
                     "choice");
  const bool told = rest_.size() > 4 && LowerCase(std::string(rest_.substr(0, 4))) == "sep=";
  const size_t first = told ? 4 : std::min(rest_.find_first_of(",;\t\n\r"), rest_.size());
  const bool known = first < rest_.size() && kSeparators.find(rest_[first]) != kSeparators.npos;
  if (known) separator_ = rest_[first];
  if (told) Next();
}

CsvRecord CsvReader::Next() {
  CsvRecord fields;
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

std::string CsvReader::NumberText(std::string_view field, size_t line) const {
  std::string text(CsvText(field));
  const size_t comma = text.find(',');
  if (comma != text.npos && separator_ == ',')
    ThrowAt(line,
            "a number has a decimal comma; write decimal points, or separate the columns by semicolons");
  if (comma != text.npos) text[comma] = '.';
  if (text.starts_with('+')) text.erase(0, 1);
  return text;
}

void CsvReader::RequireNoMoreColumns(const CsvRecord& record, size_t columns, size_t line) const {
  for (size_t column = columns; column < record.size(); ++column) {
    if (!CsvText(record[column]).empty())
      ThrowAt(line,
              "there are more columns than in the header; are there decimal commas? Write decimal points, or "
              "separate the columns by semicolons");
  }
}

void CsvReader::ThrowAt(size_t line, const std::string& what) const {
  throw InputError(name_ + ", line " + std::to_string(line) + ": " + what);
}

size_t CsvReader::FieldLength() const {
  const size_t behind_quotes = rest_.starts_with('"') ? QuotedLength() : 0;
  const char ends[] = {separator_, '\n', '\r'};
  return std::min(rest_.find_first_of({ends, sizeof ends}, behind_quotes), rest_.size());
}

size_t CsvReader::QuotedLength() const {
  for (size_t quote = rest_.find('"', 1); quote != rest_.npos; quote = rest_.find('"', quote + 2)) {
    if (quote + 1 == rest_.size() || rest_[quote + 1] != '"') return quote + 1;
  }
  ThrowAt(line_, "a field begins with a quote that is never closed; write a quote inside a field as \"\"");
}

void CsvReader::CountLines(std::string_view field) {
  for (size_t i = 0; i < field.size(); ++i)
    line_ += field[i] == '\n' || (field[i] == '\r' && (i + 1 == field.size() || field[i + 1] != '\n'));
}

}  // namespace kvx
