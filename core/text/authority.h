// Whom an address of http or https names: "example.org", "127.0.0.1:8080", "[::1]:8080".
#pragma once
#include <string_view>

namespace kvx {

// A host, or a host and a port; no user name (RFC 3986, 3.2). Stricter than the standard about names, so that
// all who read one mean the same host: letters, digits, '.', '-' and '_'.
bool IsAuthority(std::string_view text);

}  // namespace kvx
