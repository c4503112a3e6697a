// The text of a SHA-256 digest, as Digest::Hex writes it.
#pragma once
#include <string_view>

namespace kvx {

// 64 hexadecimal digits in small letters.
inline bool IsHexDigest(std::string_view text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == text.npos;
}

}  // namespace kvx
