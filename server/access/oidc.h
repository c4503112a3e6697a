// Bearer tokens of an OpenID Connect provider:
// signed JWTs, checked against the provider's published keys (JWKS).
#pragma once
#include <memory>
#include <string>
#include <string_view>

#include "server/access/identity.h"

namespace kvx {

struct OidcOptions {
  std::string issuer, audience;
  std::string jwks;  // a file or an https:// address (http:// on loopback only)
  std::string project_claim = "kinevox_project";
  std::string scope_claim = "scope";  // holds kinevox.read, kinevox.write or kinevox.admin
  bool On() const { return !issuer.empty(); }
};

// Thread-safe. Keys are fetched again for an unknown key id and when they are ten minutes old, but not more
// often than every half minute. Where that fails they are trusted for an hour in all.
class OidcVerifier {
 public:
  // Tokens are held against `now`, the age of the keys against `steady`. Throws InputError for options that
  // cannot work.
  OidcVerifier(OidcOptions options, ClockMs now, ClockMs steady = SteadyClockMs);
  ~OidcVerifier();
  Identity Verify(std::string_view token);  // throws Unauthorised, Forbidden; Unavailable without keys

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
