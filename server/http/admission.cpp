// Every routed request passes here; a route that is not listed as open needs an identity.
#include <algorithm>
#include <sstream>

#include "api/room_watch.h"
#include "server/http/http_context.h"
#include "server/log.h"
#include "storage/ids.h"

namespace kvx {
namespace {

constexpr char kScopeKey[] = "scope", kWatchKey[] = "watch";
constexpr int64_t kRefusalsKeptPerMinute = 60;

using ScopePointer = std::shared_ptr<RequestScope>;
using WatchPointer = std::shared_ptr<ConnectionWatch::Request>;

// https://datatracker.ietf.org/doc/draft-ietf-httpapi-ratelimit-headers: one list item for each limit.
struct RateHeaders {
  std::string policy, left;

  void Add(const std::string& name, const RateLeft& rate, int64_t window_seconds,
           httplib::Response& response) {
    if (rate.limit == 0) return;
    const std::string comma = left.empty() ? "" : ", ";
    policy +=
        comma + "\"" + name + "\";q=" + std::to_string(rate.limit) + ";w=" + std::to_string(window_seconds);
    left += comma + "\"" + name + "\";r=" + std::to_string(rate.remaining) +
            ";t=" + std::to_string(rate.reset_seconds);
    for (const char* header : {"RateLimit-Policy", "RateLimit"}) response.headers.erase(header);
    response.set_header("RateLimit-Policy", policy);
    response.set_header("RateLimit", left);
    if (rate.exceeded) response.set_header("Retry-After", std::to_string(rate.reset_seconds));
  }
};

// Bytes count when they are announced: who breaks off has used them.
RateLeft TakeBytes(Access& access, const Identity& identity, const httplib::Request& request) {
  if (!access.LimitsBytes(identity)) return {};
  if (request.has_header("Transfer-Encoding")) {
    throw LengthRequired("your bytes are counted: send the body with a Content-Length");
  }
  return access.TakeBytes(identity, int64_t(request.get_header_value_u64("Content-Length")));
}

bool Reads(const httplib::Request& request) {
  const AccessScope needed = NeededScope(request.method, request.matched_route);
  return needed == AccessScope::kRead || request.method == "GET" || request.method == "HEAD" ||
         request.method == "OPTIONS";
}

// Ids of ours in the path, in what the answer says where things are, and in `named`. Never names: they can be
// a patient's.
std::string ObjectOf(const httplib::Request& request, const httplib::Response& response,
                     const std::vector<std::string>& named) {
  std::vector<std::string> ids;
  const auto add = [&](const std::string& id) {
    if (LooksLikeId(id, id.substr(0, 3)) && std::ranges::find(ids, id) == ids.end()) ids.push_back(id);
  };
  for (const auto& [name, value] : request.path_params) add(value);
  for (const char* header : {"Content-Location", "Location"}) {
    std::istringstream path(response.get_header_value(header));
    for (std::string part; std::getline(path, part, '/');) add(part);
  }
  std::ranges::for_each(named, add);
  std::string text;
  for (const std::string& id : ids) text += (text.empty() ? "" : " ") + id;
  return text;
}

bool Recorded(HttpContext& context, const httplib::Request& request, int status) {
  if (request.matched_route.empty() || IsOpenRoute(request.matched_route)) return false;
  if (status == 401 || status == 403 || status == 429) {
    return !context.refusals.Take("", kRefusalsKeptPerMinute).exceeded;
  }
  return context.options.audit_reads || !Reads(request);
}

// Handlers find only their project's records; this holds for a handler that forgets to ask for them, too.
void RequireOwn(const httplib::Request& request, Services& services) {
  const auto id = request.path_params.find("id");
  if (id == request.path_params.end()) return;
  const std::string kind = id->second.substr(0, 4);
  if (kind == "sub_") services.catalogue.RequireSubject(id->second);
  if (kind == "mdl_") services.catalogue.RequireModel(id->second);
  if (kind == "bat_") services.catalogue.RequireBatch(id->second);
  if (kind == "whk_") services.webhooks.Require(id->second);
  if (kind == "job_") services.jobs.Require(id->second);
}

// Where the method may be overridden (server/http/upload_routes.cpp). Elsewhere the header says nothing.
std::string MethodMeant(const httplib::Request& request) {
  const bool may = request.method == "POST" && request.matched_route == "/v1/uploads/:id";
  const std::string meant = may ? request.get_header_value("X-HTTP-Method-Override") : "";
  return meant.empty() ? request.method : meant;
}

// For all but reading and removing: small records lead to large files.
void RequireRoomOnDisk(const httplib::Request& request, const Services& services) {
  const std::string method = MethodMeant(request);
  if (method == "DELETE" || NeededScope(method, request.matched_route) != AccessScope::kWrite) return;
  RequireRoom(services, int64_t(request.get_header_value_u64("Content-Length")));
}

}  // namespace

namespace {
RequestScope& ScopeOf(httplib::Response& response) {
  const ScopePointer* scope = response.user_data.get<ScopePointer>(kScopeKey);
  if (!scope) throw std::logic_error("a route without admission");
  return **scope;
}
}  // namespace

Services& ServicesOf(httplib::Response& response) { return ScopeOf(response).project.services; }
const Identity& IdentityOf(httplib::Response& response) { return ScopeOf(response).identity; }

void NameObject(httplib::Response& response, const std::string& id) {
  const ScopePointer* scope = response.user_data.get<ScopePointer>(kScopeKey);
  if (scope) (*scope)->objects.push_back(id);
}

ConnectionWatch::Request* WatchedRequest(httplib::Response& response) {
  const WatchPointer* watched = response.user_data.get<WatchPointer>(kWatchKey);
  return watched ? watched->get() : nullptr;
}

ConnectionWatch::Request& WatchRequest(httplib::Response& response) {
  if (!WatchedRequest(response))
    response.user_data.set(kWatchKey, std::make_shared<ConnectionWatch::Request>());
  return *WatchedRequest(response);
}

void Admit(HttpContext& context, const httplib::Request& request, httplib::Response& response) {
  if (IsOpenRoute(request.matched_route) || request.method == "OPTIONS")
    return WatchRequest(response).Serve(false);
  const Identity identity = context.access.Identify(request.get_header_value("Authorization"));
  WatchRequest(response).Serve(true);
  const ScopePointer scope(new RequestScope{identity, {context.services, identity.project}, {}});
  Services& services = scope->project.services;
  services.abandoned = ConnectionWatch::ClientGone();
  services.reading_turn = [&context, asker = services.asker()] {
    return std::make_shared<PosingGate::Pass>(context.readings, asker);
  };
  response.user_data.set(kScopeKey, scope);
  RateHeaders headers;
  const RateLeft requests = context.access.TakeRequest(identity);
  headers.Add("requests", requests, 60, response);
  if (requests.exceeded)
    throw LimitReached("your requests of this minute are used up; Retry-After says when to go on");
  if (identity.scope < NeededScope(request.method, request.matched_route)) {
    throw Forbidden("your key or token is not allowed to do this; it takes the scope \"" +
                    std::string(NameOf(NeededScope(request.method, request.matched_route))) + "\"");
  }
  if (context.access.on()) RequireOwn(request, ServicesOf(response));
  RequireRoomFor(request, context.services.upload_quota_bytes);
  RequireRoomOnDisk(request, context.services);
  const RateLeft bytes = TakeBytes(context.access, identity, request);
  headers.Add("bytes", bytes, kDayMs / 1000, response);
  if (bytes.exceeded) {
    throw LimitReached(
        "the bytes that you may send today (UTC) are used up; Retry-After says when to go on, or ask for a "
        "larger quota");
  }
}

void Audit(HttpContext& context, const httplib::Request& request, httplib::Response& response) try {
  if (!Recorded(context, request, response.status)) return;
  const ScopePointer* scope = response.user_data.get<ScopePointer>(kScopeKey);
  const Identity nobody{.who = "-", .project = "-"};
  const Identity& identity = scope ? (*scope)->identity : nobody;
  const std::string object =
      ObjectOf(request, response, scope ? (*scope)->objects : std::vector<std::string>());
  context.services.audit.Append({identity.who, identity.project, request.method + " " + request.matched_route,
                                 object, std::to_string(response.status)});
} catch (...) {
  LogError("audit entry not stored", {{"request", response.get_header_value("X-Request-Id")},
                                      {"error", DescribeForLog(std::current_exception())}});
}

}  // namespace kvx
