// What is looked at before any handler runs.
#include <algorithm>
#include <chrono>
#include <cstdio>

#include "core/errors.h"
#include "core/text/lower_case.h"
#include "server/address.h"
#include "server/http/http_context.h"
#include "server/http/known_paths.h"

namespace kvx {
namespace {

constexpr auto kLongestBody = std::chrono::seconds(120);  // of requests other than uploads

bool Broken(const std::string& value) {
  return value.find_first_of(std::string_view("\r\n\0", 3)) != std::string::npos;
}

// RFC 3986, 3.2.2 and RFC 1034, 3.1: names are the same whatever their case, and with the root's dot.
std::string HostIn(const std::string& authority) {
  std::string host = LowerCase(WithoutPort(authority));
  if (host.ends_with('.')) host.pop_back();
  return host;
}

bool AnswersTo(const std::string& host, const HttpOptions& options) {
  if (IsLoopback(host)) return true;
  if (!options.hosts.empty()) return std::ranges::find(options.hosts, host, LowerCase) != options.hosts.end();
  return options.access.On();  // a token is no ambient right: a page under another name has none
}

// By a link, of whatever page, to what says nothing of anybody. The page sees nothing of it.
bool IsVisit(const httplib::Request& request) {
  return request.method == "GET" && IsOpenRoute(request.path) &&
         request.get_header_value("Sec-Fetch-Mode") == "navigate" &&
         request.get_header_value("Sec-Fetch-Dest") == "document";
}

bool ForeignOrigin(const httplib::Request& request) {
  if (request.get_header_value("Sec-Fetch-Site") == "cross-site" && !IsVisit(request)) return true;
  const std::string origin = request.get_header_value("Origin");
  return !origin.empty() && origin != "http://" + request.get_header_value("Host") &&
         origin != "https://" + request.get_header_value("Host");
}

// The library leaves them out.
void RequireNamesOfParameters(const std::string& target) {
  const size_t question = target.find('?');
  if (question == target.npos) return;
  const std::string query = "&" + target.substr(question + 1);
  if (query.find("&=") != query.npos) throw InputError("a query parameter has no name; write name=value");
}

// RFC 9112, 6.3: a request that tells no length has no body. The library would take the next request for it,
// and it owns the request as a mutable object.
void TellThereIsNoBody(const httplib::Request& request) {
  if (request.has_header("Content-Length") || request.has_header("Transfer-Encoding")) return;
  const_cast<httplib::Request&>(request).headers.emplace("Content-Length", "0");
}

// RFC 9112, 3.2.2: a target may be a whole address, as for a proxy. Its host counts then, not the header's.
// The library routes by the path and owns the request as a mutable object.
void TakeHostFromTarget(const httplib::Request& request) {
  if (request.get_header_value_count("Host") > 1) return;  // refused as any such request is
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (!request.path.starts_with(scheme)) continue;
    const std::string address = request.path.substr(scheme.size());
    const size_t path = std::min(address.find('/'), address.size());
    auto& changed = const_cast<httplib::Request&>(request);
    changed.path = path < address.size() ? address.substr(path) : "/";
    changed.headers.erase("Host");
    changed.headers.emplace("Host", address.substr(0, path));
    return;
  }
}

// The library knows the word in small letters alone, and none beside it (RFC 9110, 7.6.1: a list, whatever
// the case).
void HearWishToClose(const httplib::Request& request) {
  std::string wishes = "," + LowerCase(request.get_header_value("Connection")) + ",";
  std::erase_if(wishes, [](char c) { return c == ' ' || c == '\t'; });
  if (wishes.find(",close,") != wishes.npos) CloseAfterwards(request);
}

// RFC 9110, 8.4.1: no coding. The library would look for one.
void ForgetIdentity(const httplib::Request& request) {
  if (LowerCase(request.get_header_value("Content-Encoding")) == "identity")
    const_cast<httplib::Request&>(request).headers.erase("Content-Encoding");
}

}  // namespace

// The library closes after this answer when the request wishes so, and it owns the request as a mutable
// object.
void CloseAfterwards(const httplib::Request& request) {
  auto& headers = const_cast<httplib::Request&>(request).headers;
  headers.erase("Connection");
  headers.emplace("Connection", "close");
}

void ReadAsMeant(const httplib::Request& request) {
  TellThereIsNoBody(request);
  HearWishToClose(request);
  ForgetIdentity(request);
  TakeHostFromTarget(request);
}

Query QueryOf(const httplib::Request& request) {
  RequireNamesOfParameters(request.target);
  return Query(request.params.begin(), request.params.end());
}

std::string KeyIn(const httplib::Request& request) { return request.get_header_value("Idempotency-Key"); }

void RequireKnownParameters(const httplib::Request& request) {
  const Query query = QueryOf(request);
  const bool of_api = request.path.starts_with("/v1/");  // probes of the others may carry any
  if (of_api && TakesNoParameters(request.method, request.path)) RequireKnown(query, {});
}

Conditions ConditionsOf(const httplib::Request& request) {
  Conditions conditions;
  if (request.method != "POST") conditions.if_none_match = request.get_header_value("If-None-Match");
  conditions.if_match = request.get_header_value("If-Match");
  // A range is one of the plain bytes: what a client cuts out of a coded file cannot be read.
  if (!request.has_header("Range")) conditions.accept_encoding = request.get_header_value("Accept-Encoding");
  return conditions;
}

std::string ReadBody(const httplib::ContentReader& reader, size_t limit_bytes,
                     const std::function<bool()>& admit_large) {
  std::string body;
  bool too_large = false, too_slow = false, too_many = false;
  const auto begin = std::chrono::steady_clock::now();
  const bool complete = reader([&](const char* data, size_t size) {
    too_large = body.size() + size > limit_bytes;
    too_slow = std::chrono::steady_clock::now() - begin > kLongestBody;
    const bool grows_large = body.size() <= kLargeBody && body.size() + size > kLargeBody;
    too_many = grows_large && admit_large && !admit_large();
    if (!too_large && !too_many) body.append(data, size);
    return !too_large && !too_slow && !too_many;
  });
  if (too_slow) throw InputError("the body came too slowly; send it again");
  if (too_large) throw BodyTooLarge("the body is larger than this address accepts");
  if (too_many) throw Unavailable("too many large bodies come at once; send it again in a moment");
  if (!complete) throw InputError("the body broke off");
  return body;
}

WholeBody ReadWhole(HttpContext& context, httplib::Response& response, const httplib::ContentReader& reader,
                    size_t limit_bytes) {
  ProjectShares::Place place;
  WholeBody body;
  body.text = ReadBody(reader, limit_bytes, [&] {
    place = context.large_bodies.TryTake(IdentityOf(response).project);
    return place != nullptr;
  });
  if (place) {
    response.user_data.set("large body", place);  // the answer may be as large
    body.take_turn = [&context, asker = ServicesOf(response).asker()] {
      return std::make_shared<PosingGate::Pass>(context.parsing, asker);
    };
    body.StepBack();
  }
  return body;
}

bool BodyPace::TooSlow(size_t more_bytes) {
  constexpr double kLeastBytesPerSecond = 1024;
  bytes_ += more_bytes;
  const auto took = std::chrono::steady_clock::now() - began_;
  return took > seconds_ &&
         double(bytes_) < kLeastBytesPerSecond * std::chrono::duration<double>(took).count();
}

void RequireRoomFor(const httplib::Request& request, int64_t most_bytes) {
  // A little over the limit is left to whoever reads the body and can say more
  const uint64_t announced = request.get_header_value_u64("Content-Length");
  if (announced <= uint64_t(most_bytes) + kBodySlack) return;
  char limit[32];
  std::snprintf(limit, sizeof limit, "%.3g", double(most_bytes) / double(int64_t(1) << 30));
  throw BodyTooLarge("the service takes files of up to " + std::string(limit) +
                     " GiB; its operator can raise limits.upload_gib");
}

std::optional<Problem> Refusal(const httplib::Request& request, const HttpOptions& options) {
  for (const auto& [name, value] : request.headers) {
    if (Broken(value))
      return Problem{400, "invalid-request", "The request is wrong", "a header holds a line break or NUL"};
  }
  if (request.get_header_value_count("Host") > 1)  // each reader may believe another one
    return Problem{400, "invalid-request", "The request is wrong", "there is more than one Host header"};
  const bool writes = request.method != "GET" && request.method != "HEAD";
  if (writes && request.has_header("Idempotency-Key") &&
      request.get_header_value("Idempotency-Key").empty()) {  // a variable that was not set
    return Problem{400, "invalid-request", "The request is wrong",
                   "the Idempotency-Key is empty; give it a value or leave it out"};
  }
  if (request.has_header("Content-Encoding")) {
    return Problem{415, "unsupported-media", "Unsupported media type",
                   "send the body without Content-Encoding"};
  }
  if (request.get_header_value("Content-Type").starts_with("multipart/")) {
    return Problem{415, "unsupported-media", "Unsupported media type",
                   "send the file itself as the body, not a form"};
  }
  if (!AnswersTo(HostIn(request.get_header_value("Host")), options)) {
    return Problem{421, "misdirected", "Misdirected request",
                   "this service does not answer to this host name"};
  }
  if (ForeignOrigin(request) && !AllowedOrigin(request, options)) {
    return Problem{403, "forbidden", "Forbidden", "pages of other origins may not use this service"};
  }
  return std::nullopt;
}

}  // namespace kvx
