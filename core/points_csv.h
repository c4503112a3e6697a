// Points files of the contract: CSV with the header x,y,z in LPS mm; further columns are carried through as
// they are.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "core/frames.h"

namespace kvx {

struct PointTable {
  std::string extra_header;  // ",name,tissue", or empty: with its leading comma, as in the file
  std::vector<PointMm> points;
  std::vector<std::string> extra;  // of every row, as extra_header
};

// Numbers are read and written the same in every locale. Throws InputError naming the line that is wrong.
PointTable ParsePoints(std::string_view csv);
std::string FormatPoints(const PointTable& table);

}  // namespace kvx
