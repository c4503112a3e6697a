// RFC 3986 authorities, as far as http:// and https:// need them: no user names.
#include "server/address.h"

#include <arpa/inet.h>

#include <algorithm>

#include "core/errors.h"
#include "core/text/authority.h"

namespace kvx {

UrlParts SplitUrl(std::string_view url) {
  const size_t scheme = url.find("://");
  const size_t host = scheme + 3;
  const size_t path = scheme == url.npos ? url.npos : std::min(url.find_first_of("/?", host), url.size());
  if (path == url.npos || !IsAuthority(url.substr(host, path - host)))
    throw InputError("an address looks like https://host:port/path");
  UrlParts parts{std::string(url.substr(0, path)), WithoutPort(url.substr(host, path - host)),
                 std::string(url.substr(path))};
  if (!parts.path.starts_with('/')) parts.path.insert(0, "/");
  return parts;
}

std::string WithoutPort(std::string_view authority) {
  if (authority.starts_with('[')) return std::string(authority.substr(1, authority.find(']') - 1));
  return std::string(authority.substr(0, authority.find(':')));
}

bool IsLoopback(const std::string& host) {
  if (host == "localhost" || host == "::1") return true;
  in_addr address{};
  return ::inet_pton(AF_INET, host.c_str(), &address) == 1 && (ntohl(address.s_addr) >> 24) == 127;
}

}  // namespace kvx
