// What is looked at before any handler runs.
#include <algorithm>

#include "server/http_context.h"

namespace kvx {
namespace {

bool Broken(const std::string& value) {
  return value.find_first_of(std::string_view("\r\n\0", 3)) != std::string::npos;
}

// "127.0.0.1:8080" -> "127.0.0.1", "[::1]:8080" -> "::1"
std::string WithoutPort(const std::string& authority) {
  if (authority.starts_with('[')) return authority.substr(1, authority.find(']') - 1);
  return authority.substr(0, authority.find(':'));
}

bool ForeignOrigin(const httplib::Request& request) {
  if (request.get_header_value("Sec-Fetch-Site") == "cross-site") return true;
  const std::string origin = request.get_header_value("Origin");
  return !origin.empty() && origin != "http://" + request.get_header_value("Host") &&
         origin != "https://" + request.get_header_value("Host");
}

}  // namespace

Query QueryOf(const httplib::Request& request) { return Query(request.params.begin(), request.params.end()); }

Conditions ConditionsOf(const httplib::Request& request) {
  Conditions conditions;
  if (request.method != "POST") conditions.if_none_match = request.get_header_value("If-None-Match");
  // A range is one of the plain bytes: what a client cuts out of a coded file cannot be read.
  if (!request.has_header("Range")) conditions.accept_encoding = request.get_header_value("Accept-Encoding");
  conditions.abandoned = request.is_connection_closed;
  return conditions;
}

std::string ReadBody(const httplib::ContentReader& reader, size_t limit_bytes) {
  std::string body;
  bool too_large = false;
  const bool complete = reader([&](const char* data, size_t size) {
    too_large = body.size() + size > limit_bytes;
    if (!too_large) body.append(data, size);
    return !too_large;
  });
  if (too_large) throw BodyTooLarge("the body is larger than this address accepts");
  if (!complete) throw InputError("the body broke off");
  return body;
}

std::optional<Problem> Refusal(const httplib::Request& request) {
  for (const auto& [name, value] : request.headers) {
    if (Broken(value)) return Problem{400, "invalid-request", "The request is wrong", "a header holds a line break or NUL"};
  }
  if (request.has_header("Content-Encoding") && request.get_header_value("Content-Encoding") != "identity") {
    return Problem{415, "unsupported-media", "Unsupported media type", "send the body without Content-Encoding"};
  }
  if (request.get_header_value("Content-Type").starts_with("multipart/")) {
    return Problem{415, "unsupported-media", "Unsupported media type", "send the file itself as the body, not a form"};
  }
  if (!IsLoopback(WithoutPort(request.get_header_value("Host")))) {
    return Problem{421, "misdirected", "Misdirected request", "this service answers to its loopback address only"};
  }
  if (ForeignOrigin(request)) {
    return Problem{403, "forbidden", "Forbidden", "pages of other origins may not use this service"};
  }
  return std::nullopt;
}

}  // namespace kvx
