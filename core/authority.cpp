#include "core/authority.h"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <string>

namespace kvx {
namespace {

constexpr size_t kLongestName = 253;

bool IsName(std::string_view text) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '-' || c == '_';
  };
  return !text.empty() && text.size() <= kLongestName && std::ranges::all_of(text, allowed);
}

// Without an IPv4 address at its end, which few take.
bool IsAddress6(std::string_view text) {
  in6_addr address{};
  return text.find('.') == text.npos && ::inet_pton(AF_INET6, std::string(text).c_str(), &address) == 1;
}

bool IsPort(std::string_view text) {
  unsigned port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && end == text.data() + text.size() && port >= 1 && port <= 65535;
}

}  // namespace

bool IsAuthority(std::string_view text) {
  const bool in_brackets = text.starts_with('[');
  const size_t end = std::min(in_brackets ? text.find(']') : text.find(':'), text.size());
  const size_t rest = in_brackets ? end + 1 : end;  // where ":port" begins
  if (rest > text.size()) return false;
  if (in_brackets ? !IsAddress6(text.substr(1, end - 1)) : !IsName(text.substr(0, end))) return false;
  return rest == text.size() || (text[rest] == ':' && IsPort(text.substr(rest + 1)));
}

}  // namespace kvx
