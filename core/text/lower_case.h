// Text without regard to case: ASCII letters made small, everything else as it is.
#pragma once
#include <algorithm>
#include <string>

namespace kvx {

inline std::string LowerCase(std::string text) {
  std::ranges::transform(text, text.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
  return text;
}

}  // namespace kvx
