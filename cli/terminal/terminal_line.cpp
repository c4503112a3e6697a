// UTF-8 is told by its first bytes; what is none counts byte by byte.
#include "cli/terminal/terminal_line.h"

#include <sys/ioctl.h>

#include <algorithm>
#include <limits>

namespace kvx {
namespace {

size_t BytesOfLetter(std::string_view text) {
  const auto first = static_cast<unsigned char>(text[0]);
  const size_t bytes = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : first >= 0xC0 ? 2 : 1;
  if (bytes > text.size()) return 1;
  const auto goes_on = [](char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; };
  return std::all_of(text.begin() + 1, text.begin() + std::ptrdiff_t(bytes), goes_on) ? bytes : 1;
}

struct Measured {
  size_t bytes = 0, columns = 0;
};

Measured Within(size_t columns, std::string_view text) {
  Measured whole;
  while (whole.bytes < text.size()) {
    const size_t bytes = BytesOfLetter(text.substr(whole.bytes)), wide = bytes > 2 ? 2 : 1;
    if (whole.columns + wide > columns) break;
    whole.bytes += bytes, whole.columns += wide;
  }
  return whole;
}

}  // namespace

size_t ColumnsOf(std::FILE* terminal) {
  winsize size{};
  if (::ioctl(fileno(terminal), TIOCGWINSZ, &size) != 0 || size.ws_col == 0)
    return std::numeric_limits<size_t>::max();
  return size.ws_col - size_t(1);
}

size_t WidthOf(std::string_view text) { return Within(std::numeric_limits<size_t>::max(), text).columns; }

std::string CutTo(size_t columns, std::string_view text) {
  return std::string(text.substr(0, Within(columns, text).bytes));
}

std::string FilledTo(size_t columns, std::string_view text) {
  return CutTo(columns, text) + std::string(columns - Within(columns, text).columns, ' ');
}

}  // namespace kvx
