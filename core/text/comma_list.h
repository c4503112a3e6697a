// Names in one value of an option or a parameter.
#pragma once
#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace kvx {

// Adds those between the commas of `text`, in their order; none that is empty or there already.
inline void AddNamesOf(std::string_view text, std::vector<std::string>& names) {
  for (std::string_view rest = text; !rest.empty();) {
    const size_t end = std::min(rest.find(','), rest.size());
    const std::string_view name = rest.substr(0, end);
    if (end > 0 && std::ranges::find(names, name) == names.end()) names.emplace_back(name);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
}

}  // namespace kvx
