// Names in a sentence.
#pragma once
#include <functional>
#include <string>

namespace kvx {

// "a, b, c"; `name_of` gives an element's name, as text.
template <class Names, class NameOf = std::identity>
std::string Listed(const Names& names, NameOf name_of = {}) {
  std::string out;
  bool first = true;
  for (const auto& name : names) {
    if (!first) out += ", ";
    out += std::invoke(name_of, name);
    first = false;
  }
  return out;
}

}  // namespace kvx
