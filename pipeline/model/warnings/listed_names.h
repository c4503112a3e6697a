// Names in a warning, the first of many.
#pragma once
#include <ranges>
#include <string>
#include <vector>

#include "core/text/listed.h"

namespace kvx {

// "3, 7, 12 and 4 more"
inline std::string ListedInBrief(const std::vector<std::string>& names) {
  constexpr size_t kMostNamed = 12;
  std::string out = Listed(std::views::take(names, kMostNamed));
  if (names.size() > kMostNamed) out += " and " + std::to_string(names.size() - kMostNamed) + " more";
  return out;
}

// A line; none where there is nobody to name.
inline std::vector<std::string> Naming(const std::string& what, const std::vector<std::string>& names) {
  if (names.empty()) return {};
  return {what + ListedInBrief(names)};
}

}  // namespace kvx
