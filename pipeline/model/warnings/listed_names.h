// Names in a sentence.
#pragma once
#include <algorithm>
#include <string>
#include <vector>

namespace kvx {

// "3, 7, 12 and 4 more"
inline std::string Listed(const std::vector<std::string>& names) {
  constexpr size_t kMostNamed = 12;
  std::string out;
  for (size_t n = 0; n < std::min(names.size(), kMostNamed); ++n) out += (n ? ", " : "") + names[n];
  if (names.size() > kMostNamed) out += " and " + std::to_string(names.size() - kMostNamed) + " more";
  return out;
}

// A line; none where there is nobody to name.
inline std::vector<std::string> Naming(const std::string& what, const std::vector<std::string>& names) {
  if (names.empty()) return {};
  return {what + Listed(names)};
}

}  // namespace kvx
