// Lines that stay on one row of a terminal: what is wrapped cannot be drawn again in its place.
#pragma once
#include <cstdio>
#include <string>
#include <string_view>

namespace kvx {

// A row's columns but the last, behind which some terminals wrap at once. A terminal that does not say how
// wide it is has room.
size_t ColumnsOf(std::FILE* terminal);

// In columns. A letter of more than two bytes counts as two, which it may be wide.
size_t WidthOf(std::string_view text);
// Its beginning, in whole letters.
std::string CutTo(size_t columns, std::string_view text);
std::string FilledTo(size_t columns, std::string_view text);  // cut, or with blanks behind it

}  // namespace kvx
