// Points files of the contract: CSV with the header x,y,z in LPS mm; further columns are carried through as
// they are. Tables as spreadsheets save them elsewhere (semicolons or tabs, decimal commas) are read as well.
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

// Numbers are read and written the same in every locale; a row nan,nan,nan is a point that is nowhere, as
// mapping one back may have left it. Written with commas and decimal points whatever was read. Throws
// InputError naming the line that is wrong.
PointTable ParsePoints(std::string_view csv);
std::string FormatPoints(const PointTable& table);

// Puts map(points) in the place of those that are somewhere; map gives as many as it gets.
template <class Map>
void ReplacePoints(std::vector<PointMm>& points, const Map& map) {
  std::vector<PointMm> somewhere;
  for (const PointMm& point : points) {
    if (point.lps.allFinite()) somewhere.push_back(point);
  }
  const std::vector<PointMm> mapped = map(somewhere);
  size_t next = 0;
  for (PointMm& point : points) {
    if (point.lps.allFinite()) point = mapped[next++];
  }
}

}  // namespace kvx
