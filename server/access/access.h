// Who a request comes from, what they may do, and how much of it: API keys, OIDC tokens, rates and quotas.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/access/oidc.h"
#include "storage/api_keys.h"

namespace kvx {

struct AccessOptions {
  bool api_keys = false;
  OidcOptions oidc;     // without an issuer: off
  Quota default_quota;  // of who has none of their own
  bool On() const { return api_keys || oidc.On(); }
};

// What is left to a client of a limit: requests of this minute, or bytes of this day.
struct RateLeft {
  int64_t limit = 0, remaining = 0, reset_seconds = 0;  // limit 0: none
  bool exceeded = false;
};

// A minute's requests may come at once; they come back evenly over the minute.
class RateLimiter {
 public:
  explicit RateLimiter(ClockMs now) : now_(std::move(now)) {}
  RateLeft Take(const std::string& who, int64_t per_minute);

 private:
  struct Bucket {
    double tokens = 0;
    int64_t filled_ms = 0;
  };
  ClockMs now_;
  std::mutex mutex_;
  std::map<std::string, Bucket> buckets_;
};

class Access {
 public:
  Access(ApiKeys& keys, const AccessOptions& options, ClockMs now);
  // Of the Authorization header. Throws Unauthorised. Without authentication everybody is "local".
  Identity Identify(const std::string& authorization);
  // Of one that was identified, when its upload has come. A token that became too old meanwhile is none of
  // these: it was good when that began. Throws Unauthorised.
  void RequireNotRevoked(const std::string& authorization);
  RateLeft TakeRequest(const Identity& identity);
  // Counts what a client announces to send before it is read; nothing when it would exceed the limit.
  RateLeft TakeBytes(const Identity& identity, int64_t bytes);
  bool LimitsBytes(const Identity& identity) const { return identity.quota.bytes_per_day.has_value(); }
  bool on() const { return options_.On(); }

 private:
  ApiKeys& keys_;
  AccessOptions options_;
  ClockMs now_;
  RateLimiter rates_;
  std::unique_ptr<OidcVerifier> oidc_;
};

// The least scope that a request needs: reading and posing read;
// deleting subjects and the audit trail are for admins.
AccessScope NeededScope(const std::string& method, const std::string& route);
bool IsOpenRoute(const std::string& route);  // answers without a token

}  // namespace kvx
