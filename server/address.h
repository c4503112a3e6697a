// Who is at an address: hosts in URLs and in Host headers, and what counts as this very machine.
#pragma once
#include <string>
#include <string_view>

namespace kvx {

struct UrlParts {
  std::string origin;  // "http://127.0.0.1:8080"
  std::string host;    // without brackets and port: "127.0.0.1", "::1"
  std::string path;    // with its query; "/" where the URL has none
};

// Of "scheme://host[:port][/path]". Throws InputError where there is no scheme, or no host that
// all readers would take for the same.
UrlParts SplitUrl(std::string_view url);

// Of a Host header: "127.0.0.1:8080" -> "127.0.0.1", "[::1]:8080" -> "::1"
std::string WithoutPort(std::string_view authority);

bool IsLoopback(const std::string& host);  // 127.x.x.x, ::1, localhost

}  // namespace kvx
