// Paragraphs are one line each where they are written.
#include "cli/options/help_format.h"

#include <sstream>

namespace kvx {
namespace {

constexpr size_t kGroupIndent = 2;  // of the options of a group

void AddWrapped(const std::string& line, size_t width, std::string& out) {
  std::istringstream words(line);
  size_t column = 0;
  for (std::string word; words >> word;) {
    const bool fits = column == 0 || column + 1 + word.size() <= width;
    if (column > 0) out += fits ? ' ' : '\n';
    column = fits && column > 0 ? column + 1 + word.size() : word.size();
    out += word;
  }
}

}  // namespace

std::string Wrapped(const std::string& text, size_t width) {
  std::istringstream lines(text);
  std::string out;
  for (std::string line; std::getline(lines, line);) {
    if (!out.empty()) out += '\n';
    if (line.starts_with(' '))
      out += line;
    else
      AddWrapped(line, width, out);
  }
  return out;
}

std::string HelpFormat::make_option_desc(const CLI::Option* option) const {
  return Wrapped(option->get_description(), kWidth - get_column_width() - kGroupIndent);
}

std::string HelpFormat::make_footer(const CLI::App* app) const {
  const std::string footer = app->get_footer();
  return footer.empty() ? "" : Wrapped(footer, kWidth) + "\n";
}

}  // namespace kvx
