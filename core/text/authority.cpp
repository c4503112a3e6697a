#include "core/text/authority.h"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <string>

#include "core/name.h"

namespace kvx {
namespace {

constexpr size_t kLongestHost = 253;

bool IsHost(std::string_view text) {
  return !text.empty() && text.size() <= kLongestHost && AreNameCharacters(text);
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
  if (in_brackets ? !IsAddress6(text.substr(1, end - 1)) : !IsHost(text.substr(0, end))) return false;
  return rest == text.size() || (text[rest] == ':' && IsPort(text.substr(rest + 1)));
}

}  // namespace kvx
