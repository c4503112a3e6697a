// What scans, bones, joints and angles may be called: safe in a URL, and as a file's name that may be hidden.
#pragma once
#include <algorithm>
#include <string_view>

namespace kvx {

constexpr size_t kLongestName = 64;

// Letters and digits of ASCII, '.', '_' and '-', whatever the locale.
inline bool AreNameCharacters(std::string_view text) {
  return std::ranges::all_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  });
}

inline bool IsName(std::string_view text) {
  return !text.empty() && text.size() <= kLongestName && AreNameCharacters(text) && text != "." &&
         text != "..";
}

constexpr size_t kLongestTitle = 256;  // bytes

// What people call a study or a subject: one line, without control characters of ASCII.
inline bool IsTitle(std::string_view text) {
  return text.size() <= kLongestTitle &&
         std::ranges::none_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7f; });
}

}  // namespace kvx
