// Tables as programs and spreadsheets save them: RFC 4180, with commas, semicolons or tabs between the
// fields, decimal commas where these are not commas, lines that end in LF, CR LF or CR.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace kvx {

using CsvRecord = std::vector<std::string_view>;  // fields as they stand in the file, quotes and all

// Without the blanks and quotes around it.
std::string_view CsvText(std::string_view field);

class CsvReader {
 public:
  // `text` stays as long as what is read of it; `name`: what messages call the file. Throws InputError for
  // what is no plain text. A byte order mark and a line `sep=;`, which is there for Excel, are passed over.
  CsvReader(std::string_view text, std::string name);

  bool AtEnd() const { return rest_.empty(); }
  size_t line() const { return line_; }  // on which the next record begins, from 1
  char separator() const { return separator_; }

  CsvRecord Next();
  // A number's text, with a decimal point and without a plus sign.
  std::string NumberText(std::string_view field, size_t line) const;
  // Decimal commas between commas would be read as columns.
  void RequireNoMoreColumns(const CsvRecord& record, size_t columns, size_t line) const;
  [[noreturn]] void ThrowAt(size_t line, const std::string& what) const;

 private:
  size_t FieldLength() const;
  size_t QuotedLength() const;
  void CountLines(std::string_view field);

  std::string_view rest_;
  std::string name_;
  char separator_ = ',';
  size_t line_ = 1;
};

}  // namespace kvx
