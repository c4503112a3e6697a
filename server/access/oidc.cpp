// Signatures by libcjose (OpenSSL below); which algorithms count,
// who issued, for whom and until when is checked here.
#include "server/access/oidc.h"

#include <cjose/cjose.h>

#include <algorithm>
#include <condition_variable>
#include <fstream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>

#include "api/errors.h"
#include "core/errors.h"
#include "server/address.h"
#include "server/http_library.h"
#include "server/log.h"

namespace kvx {
namespace {

using nlohmann::json;

constexpr int64_t kLeewayS = 60, kFetchAgainMs = 30'000;
constexpr int64_t kRenewAfterMs = 600'000;  // a key that the provider has withdrawn is trusted no longer
constexpr int64_t kTrustedMs = 3'600'000;   // without hearing from the provider
constexpr int kFetchSeconds = 5;            // all together
constexpr int kMostWaiting = 16;            // for keys that somebody else fetches; each holds a thread
constexpr size_t kLongestToken = 16 * 1024, kLargestJwks = 1 << 20;
constexpr char kNoKeySet[] = "what the identity provider publishes is not a set of keys (JWKS)";
constexpr char kInvalid[] =
    "the token is not valid here: it is damaged, expired, or meant for another service";

template <class T, void (*Release)(T*)>
struct Releaser {
  void operator()(T* item) const { Release(item); }
};
void ReleaseJwk(cjose_jwk_t* key) { cjose_jwk_release(key); }
void ReleaseJws(cjose_jws_t* token) { cjose_jws_release(token); }
using Jws = std::unique_ptr<cjose_jws_t, Releaser<cjose_jws_t, ReleaseJws>>;
using Jwk = std::shared_ptr<cjose_jwk_t>;
using Keys = std::map<std::string, Jwk>;  // by key id

// Public-key signatures alone: "none" and shared secrets let anybody sign who knows the published keys.
bool Trusted(std::string_view algorithm) {
  constexpr std::string_view kTrusted[] = {"RS256", "RS384", "RS512", "PS256", "PS384",
                                           "PS512", "ES256", "ES384", "ES512"};
  return std::ranges::find(kTrusted, algorithm) != std::end(kTrusted);
}

std::string HeaderOf(const Jws& token, const char* name) {
  cjose_err error{};
  cjose_header_t* header = cjose_jws_get_protected(token.get());
  const char* value = header ? cjose_header_get(header, name, &error) : nullptr;
  return value ? value : "";
}

// Extensions that whoever checks must understand (RFC 7515, 4.1.11); none is understood here.
bool HasCritical(const Jws& token) {
  cjose_err error{};
  cjose_header_t* header = cjose_jws_get_protected(token.get());
  char* value = header ? cjose_header_get_raw(header, "crit", &error) : nullptr;
  if (value) cjose_get_dealloc()(value);
  return value != nullptr;
}

std::string ReadFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Unavailable("the identity provider's keys (JWKS) cannot be read");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string Fetch(const std::string& url) {
  const UrlParts parts = SplitUrl(url);
  httplib::Client client(parts.origin);
  client.set_connection_timeout(3);
  client.set_read_timeout(kFetchSeconds);
  client.set_max_timeout(std::chrono::seconds(kFetchSeconds));
  client.set_payload_max_length(kLargestJwks);
  const auto answer = client.Get(parts.path);
  if (!answer || answer->status != 200)
    throw Unavailable("the identity provider's keys (JWKS) cannot be fetched now");
  return answer->body;
}

bool IsUrl(const std::string& where) { return where.starts_with("https://") || where.starts_with("http://"); }

bool Holds(const json& claim, const std::string& word) {
  if (claim.is_array()) return std::ranges::any_of(claim, [&](const json& item) { return item == word; });
  if (!claim.is_string()) return false;
  std::istringstream words(claim.get<std::string>());
  for (std::string next; words >> next;) {
    if (next == word) return true;
  }
  return false;
}

AccessScope ScopeOf(const json& claim) {
  for (const AccessScope scope : {AccessScope::kAdmin, AccessScope::kWrite, AccessScope::kRead}) {
    if (Holds(claim, "kinevox." + std::string(NameOf(scope)))) return scope;
  }
  throw Forbidden("the token holds none of the scopes kinevox.read, kinevox.write, kinevox.admin");
}

}  // namespace

struct OidcVerifier::State {
  OidcOptions options;
  ClockMs now, steady;
  std::mutex mutex{};
  std::condition_variable fetched{};
  Keys keys{};
  std::optional<int64_t> fetched_ms{}, tried_ms{};  // of `keys`; of the last attempt
  std::string trouble{};                            // of the last attempt
  bool fetching = false;
  int waiting = 0;

  Keys FetchKeys() const;
  void Renew(std::unique_lock<std::mutex>& lock);
  void WaitForOthers(std::unique_lock<std::mutex>& lock);
  Jwk Find(const std::string& kid);
  json Claims(std::string_view token);
  void CheckClaims(const json& claims) const;
};

Keys OidcVerifier::State::FetchKeys() const {
  const json set =
      json::parse(IsUrl(options.jwks) ? Fetch(options.jwks) : ReadFile(options.jwks), nullptr, false);
  if (!set.is_object() || !set.contains("keys") || !set["keys"].is_array()) throw Unavailable(kNoKeySet);
  Keys found;
  for (const json& item : set["keys"]) {
    const std::string text = item.dump();
    cjose_err error{};
    cjose_jwk_t* key = cjose_jwk_import(text.data(), text.size(), &error);
    if (!key) continue;  // of a kind that this library does not know; others may do
    found[item.value("kid", "")] = Jwk(key, ReleaseJwk);
  }
  return found;
}

// Without the lock while it fetches: who has a known key does not wait for the provider.
void OidcVerifier::State::Renew(std::unique_lock<std::mutex>& lock) {
  fetching = true;
  tried_ms = steady();
  lock.unlock();
  std::optional<Keys> found;
  std::string wrong;
  try {
    found = FetchKeys();
  } catch (const Error& error) {
    wrong = error.what();
  } catch (const std::exception&) {
    wrong = kNoKeySet;
  }
  lock.lock();
  fetching = false;
  trouble = wrong;
  if (found) {
    keys = *std::move(found);
    fetched_ms = tried_ms;
  } else {
    LogError("keys not fetched", {{"error", trouble}});
    if (fetched_ms && steady() - *fetched_ms > kTrustedMs) keys.clear();
  }
  fetched.notify_all();
}

void OidcVerifier::State::WaitForOthers(std::unique_lock<std::mutex>& lock) {
  if (waiting >= kMostWaiting)
    throw Unavailable("the identity provider's keys are being fetched; ask again in a moment");
  ++waiting;
  fetched.wait_for(lock, std::chrono::seconds(kFetchSeconds + 1), [&] { return !fetching; });
  --waiting;
}

Jwk OidcVerifier::State::Find(const std::string& kid) {
  std::unique_lock lock(mutex);
  const int64_t now_ms = steady();
  const bool missing = !keys.contains(kid), old = fetched_ms && now_ms - *fetched_ms > kRenewAfterMs;
  const bool may_ask = !fetching && (!tried_ms || now_ms - *tried_ms > kFetchAgainMs);
  if ((missing || old) && may_ask)
    Renew(lock);
  else if (missing && fetching)
    WaitForOthers(lock);
  const auto known = keys.find(kid);
  if (known != keys.end()) return known->second;
  if (!trouble.empty()) throw Unavailable(trouble);
  return nullptr;
}

json OidcVerifier::State::Claims(std::string_view token) {
  cjose_err error{};
  const Jws jws(token.size() > kLongestToken ? nullptr
                                             : cjose_jws_import(token.data(), token.size(), &error));
  if (!jws || HasCritical(jws) || !Trusted(HeaderOf(jws, "alg"))) throw Unauthorised(kInvalid);
  const Jwk key = Find(HeaderOf(jws, "kid"));
  if (!key || cjose_jwk_get_kty(key.get(), &error) == CJOSE_JWK_KTY_OCT) throw Unauthorised(kInvalid);
  if (!cjose_jws_verify(jws.get(), key.get(), &error)) throw Unauthorised(kInvalid);
  uint8_t* text = nullptr;
  size_t size = 0;
  if (!cjose_jws_get_plaintext(jws.get(), &text, &size, &error)) throw Unauthorised(kInvalid);
  const json claims = json::parse(text, text + size, nullptr, false);
  if (!claims.is_object()) throw Unauthorised(kInvalid);
  return claims;
}

void OidcVerifier::State::CheckClaims(const json& claims) const {
  const auto number = [&](const char* name, int64_t otherwise) {
    return claims.contains(name) && claims[name].is_number() ? claims[name].get<double>() : double(otherwise);
  };
  const double now_s = double(now()) / 1000;
  const bool issued = claims.contains("iss") && claims["iss"] == options.issuer;
  const bool for_us = claims.contains("aud") && Holds(claims["aud"], options.audience);
  const bool fresh = number("exp", 0) > now_s - kLeewayS && number("nbf", 0) <= now_s + kLeewayS;
  if (!issued || !for_us || !fresh) throw Unauthorised(kInvalid);
}

OidcVerifier::OidcVerifier(OidcOptions options, ClockMs now, ClockMs steady)
    : state_(new State{std::move(options), std::move(now), std::move(steady)}) {
  const OidcOptions& o = state_->options;
  if (o.audience.empty() || o.jwks.empty())
    throw InputError("OIDC needs an issuer, an audience and a JWKS file or address");
  if (o.jwks.starts_with("http://") && !IsLoopback(SplitUrl(o.jwks).host)) {
    throw InputError("the JWKS address must be https://; keys that come in the clear can be anybody's");
  }
}

OidcVerifier::~OidcVerifier() = default;

Identity OidcVerifier::Verify(std::string_view token) {
  const json claims = state_->Claims(token);
  state_->CheckClaims(claims);
  const OidcOptions& o = state_->options;
  const auto subject = claims.find("sub"), project = claims.find(o.project_claim);
  if (subject == claims.end() || !subject->is_string()) throw Unauthorised(kInvalid);
  if (project == claims.end() || !project->is_string() || project->get_ref<const std::string&>().empty()) {
    throw Forbidden("the token names no project");
  }
  const auto scope = claims.find(o.scope_claim);
  return {"oidc:" + subject->get<std::string>(),
          project->get<std::string>(),
          ScopeOf(scope == claims.end() ? json() : *scope),
          {}};
}

}  // namespace kvx
