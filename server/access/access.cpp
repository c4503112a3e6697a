// Tokens are never logged and never repeated in an answer.
#include "server/access/access.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "api/errors.h"

namespace kvx {
namespace {

constexpr std::string_view kBearer = "Bearer ";
constexpr size_t kMostBuckets = 10'000;
constexpr char kWho[] =
    "this service asks for an API key or a token: send 'Authorization: Bearer ...' with one that is valid "
    "now";

bool StartsWithBearer(const std::string& authorization) {  // in whatever case (RFC 9110, 11.1)
  return std::ranges::equal(
      std::string_view(authorization).substr(0, kBearer.size()), kBearer,
      [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); });
}

std::string_view TokenOf(const std::string& authorization) {
  return StartsWithBearer(authorization) ? std::string_view(authorization).substr(kBearer.size()) : "";
}

bool IsKey(std::string_view token) { return token.starts_with("kvx."); }

}  // namespace

RateLeft RateLimiter::Take(const std::string& who, int64_t per_minute) {
  const int64_t now = now_();
  const std::lock_guard lock(mutex_);
  if (buckets_.size() > kMostBuckets) buckets_.clear();
  auto [found, fresh] = buckets_.try_emplace(who, Bucket{double(per_minute), now});
  Bucket& bucket = found->second;
  const double per_ms = double(per_minute) / 60'000;
  bucket.tokens = std::min(double(per_minute),
                           bucket.tokens + double(std::max<int64_t>(0, now - bucket.filled_ms)) * per_ms);
  bucket.filled_ms = now;
  RateLeft left{.limit = per_minute, .exceeded = bucket.tokens < 1};
  if (!left.exceeded) bucket.tokens -= 1;
  left.remaining = int64_t(bucket.tokens);
  const double missing = left.exceeded ? 1 - bucket.tokens : double(per_minute) - bucket.tokens;
  left.reset_seconds = int64_t(std::ceil(missing / per_ms / 1000));
  return left;
}

Access::Access(ApiKeys& keys, const AccessOptions& options, ClockMs now)
    : keys_(keys), options_(options), now_(now), rates_(now) {
  if (options.oidc.On()) oidc_ = std::make_unique<OidcVerifier>(options.oidc, now);
}

Identity Access::Identify(const std::string& authorization) {
  if (!on()) return {.quota = options_.default_quota};
  if (!StartsWithBearer(authorization)) throw Unauthorised(kWho);
  const std::string_view token = TokenOf(authorization);
  Identity identity;
  if (IsKey(token)) {
    const auto key = options_.api_keys ? keys_.Check(token) : std::nullopt;
    if (!key) throw Unauthorised(kWho);
    identity = {key->id, key->project, key->scope, key->quota};
  } else {
    if (!oidc_) throw Unauthorised(kWho);
    identity = oidc_->Verify(token);
  }
  Quota& quota = identity.quota;
  if (!quota.requests_per_minute) quota.requests_per_minute = options_.default_quota.requests_per_minute;
  if (!quota.bytes_per_day) quota.bytes_per_day = options_.default_quota.bytes_per_day;
  return identity;
}

void Access::RequireNotRevoked(const std::string& authorization) {
  if (IsKey(TokenOf(authorization))) Identify(authorization);
}

RateLeft Access::TakeRequest(const Identity& identity) {
  if (!identity.quota.requests_per_minute) return {};
  return rates_.Take(identity.who, *identity.quota.requests_per_minute);
}

RateLeft Access::TakeBytes(const Identity& identity, int64_t bytes) {
  if (!identity.quota.bytes_per_day) return {};
  const int64_t limit = *identity.quota.bytes_per_day;
  RateLeft left{.limit = limit, .reset_seconds = (kDayMs - now_() % kDayMs + 999) / 1000};
  left.exceeded = bytes > 0 && !keys_.AddBytes(identity.who, bytes, limit);
  left.remaining = std::max<int64_t>(0, limit - keys_.BytesToday(identity.who));
  return left;
}

AccessScope NeededScope(const std::string& method, const std::string& route) {
  constexpr std::array kPosing = {"/v1/models/:id/volume", "/v1/models/:id/slice", "/v1/models/:id/surface",
                                  "/v1/models/:id/field", "/v1/models/:id/points"};
  if (route.starts_with("/v1/audit") || (method == "DELETE" && route == "/v1/subjects/:id"))
    return AccessScope::kAdmin;
  const bool poses = std::ranges::find(kPosing, route) != kPosing.end();
  return method == "GET" || method == "HEAD" || poses ? AccessScope::kRead : AccessScope::kWrite;
}

bool IsOpenRoute(const std::string& route) {
  constexpr std::array kOpen = {"/", "/healthz", "/readyz", "/openapi.json", "/docs", "/docs/:file"};
  return std::ranges::find(kOpen, route) != kOpen.end();
}

}  // namespace kvx
