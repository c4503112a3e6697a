// Base64 (RFC 4648, section 4): bytes as text that survives headers.
#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace kvx {

std::string Base64(std::string_view bytes);

// The bytes; nothing where the text is not base64. Padding is needed.
std::optional<std::string> FromBase64(std::string_view text);

}  // namespace kvx
