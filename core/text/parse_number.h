// Numbers in texts: all of the text is the number, or there is none.
#pragma once
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace kvx {

// As std::from_chars reads a T: no blanks, no '+', a decimal point whatever the locale. Nothing where a T
// cannot hold it. A double may be "nan" or "inf".
template <class T>
std::optional<T> ParseAs(std::string_view text) {
  T value{};
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, value);
  if (error != std::errc() || end != last) return std::nullopt;
  return value;
}

// A finite number as people write it: "35", "+2.5", "-1e-3".
inline std::optional<double> ParseFinite(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  const std::optional<double> value = ParseAs<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

}  // namespace kvx
