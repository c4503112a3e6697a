// Headers that every answer has: security, other origins, traces.
#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <ctime>

#include "server/http/http_context.h"

namespace kvx {
namespace {

constexpr char kPolicyOfData[] = "default-src 'none'; frame-ancestors 'none'";

void SetOnce(httplib::Response& response, const char* name, const std::string& value) {
  if (!response.has_header(name)) response.set_header(name, value);
}

bool IsHex(std::string_view text) {
  const auto digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  return std::ranges::all_of(text, digit) && text.find_first_not_of('0') != text.npos;
}

std::string RandomHex(size_t bytes) {
  std::array<unsigned char, 16> random{};
  if (RAND_bytes(random.data(), int(bytes)) != 1) throw std::runtime_error("no random numbers from OpenSSL");
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (size_t i = 0; i < bytes; ++i) {
    text += kDigits[random[i] >> 4];
    text += kDigits[random[i] & 15];
  }
  return text;
}

}  // namespace

bool AllowedOrigin(const httplib::Request& request, const HttpOptions& options) {
  const std::string origin = request.get_header_value("Origin");
  return !origin.empty() && std::ranges::find(options.cors_origins, origin) != options.cors_origins.end();
}

bool AnswerPreflight(const httplib::Request& request, httplib::Response& response,
                     const HttpOptions& options) {
  if (request.method != "OPTIONS" || !request.has_header("Access-Control-Request-Method")) return false;
  if (!AllowedOrigin(request, options)) return false;
  response.set_header("Access-Control-Allow-Methods", "GET, HEAD, POST, PUT, PATCH, DELETE, OPTIONS");
  response.set_header(
      "Access-Control-Allow-Headers",
      "Authorization, Content-Type, Idempotency-Key, If-Match, If-None-Match, If-Range, Last-Event-ID, "
      "Range, "
      "traceparent, tracestate, Tus-Resumable, Upload-Checksum, Upload-Length, Upload-Metadata, "
      "Upload-Offset, "
      "X-HTTP-Method-Override");
  response.set_header("Access-Control-Max-Age", "600");
  response.status = 204;
  return true;
}

void AddCommonHeaders(const httplib::Request& request, httplib::Response& response,
                      const HttpOptions& options) {
  SetOnce(response, "Date", HttpDate(SystemClockMs()));
  SetOnce(response, "X-Content-Type-Options", "nosniff");
  SetOnce(response, "Content-Security-Policy", kPolicyOfData);
  SetOnce(response, "X-Frame-Options", "DENY");
  SetOnce(response, "Referrer-Policy", "no-referrer");
  if (options.Tls()) SetOnce(response, "Strict-Transport-Security", "max-age=31536000");
  if (options.cors_origins.empty()) {
    SetOnce(response, "Cross-Origin-Resource-Policy", "same-origin");
    return;
  }
  response.set_header("Vary", "Origin");  // beside the library's own
  if (!AllowedOrigin(request, options)) return;
  SetOnce(response, "Access-Control-Allow-Origin", request.get_header_value("Origin"));
  SetOnce(
      response, "Access-Control-Expose-Headers",
      "Content-Disposition, Content-Location, Content-Range, ETag, Location, RateLimit, RateLimit-Policy, "
      "Retry-After, traceparent, Tus-Checksum-Algorithm, Tus-Extension, Tus-Max-Size, Tus-Resumable, "
      "Tus-Version, Upload-Expires, Upload-Length, Upload-Metadata, Upload-Offset, WWW-Authenticate, "
      "X-Kinevox-Components, X-Kinevox-Direction, X-Kinevox-Extrapolation, X-Kinevox-Largest-Error-Mm, "
      "X-Kinevox-Mean-Error-Mm, "
      "X-Kinevox-Origin, X-Kinevox-P99-Error-Mm, X-Kinevox-Scan-Verdict, X-Kinevox-Size, X-Kinevox-Spacing, "
      "X-Kinevox-Type, X-Kinevox-Window, "
      "X-Request-Id");
}

std::string HttpDate(int64_t utc_ms) {
  const std::time_t seconds = std::time_t(utc_ms / 1000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[64];
  std::strftime(text, sizeof text, "%a, %d %b %Y %H:%M:%S GMT", &utc);
  return text;
}

// https://www.w3.org/TR/trace-context: version 00, trace id, span id, flags.
std::string TraceParent(const httplib::Request& request) {
  const std::string given = request.get_header_value("traceparent");
  const bool good = given.size() == 55 && given.starts_with("00-") && given[35] == '-' && given[52] == '-' &&
                    IsHex(std::string_view(given).substr(3, 32)) &&
                    IsHex(std::string_view(given).substr(36, 16));
  const std::string trace = good ? given.substr(3, 32) : RandomHex(16);
  return "00-" + trace + "-" + RandomHex(8) + "-01";
}

}  // namespace kvx
