// Where a webhook leads is judged when it is sent, not here: names change their addresses.
#include "api/handlers/webhooks.h"

#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "api/views.h"
#include "core/errors.h"
#include "core/text/authority.h"
#include "core/text/base64.h"

namespace kvx {
namespace {

constexpr std::array<std::string_view, 3> kEvents{"job.succeeded", "job.failed", "job.cancelled"};
constexpr size_t kLongestUrl = 2000;
constexpr int kShownDeliveries = 20;

std::string NewSecret() {
  unsigned char random[24];
  if (RAND_bytes(random, sizeof random) != 1) throw std::runtime_error("no random numbers from OpenSSL");
  return "whsec_" + Base64({reinterpret_cast<const char*>(random), sizeof random});
}

void RequireUrl(const std::string& url) {
  const bool scheme = url.starts_with("http://") || url.starts_with("https://");
  const bool clean =
      std::ranges::all_of(url, [](char c) { return c > ' ' && c <= '~' && c != '@' && c != '#'; });
  const size_t host = scheme ? url.find("://") + 3 : 0;
  const std::string authority = url.substr(host, url.find_first_of("/?", host) - host);
  if (!scheme || !clean || url.size() > kLongestUrl || !IsAuthority(authority)) {
    throw InputError(
        "'url' is an http or https address of at most 2000 bytes, without a user name and without '#'");
  }
}

void RequireSecret(const std::string& secret) {
  const bool base64 =
      secret.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/=", 6) ==
      secret.npos;
  const auto key = secret.starts_with("whsec_") && base64 ? FromBase64(secret.substr(6)) : std::nullopt;
  if (!key || key->size() < 24 || key->size() > 64)
    throw InputError("'secret' is whsec_ and the base64 of 24 to 64 bytes");
}

Json EventsOf(const Json& request) {
  const Json events = request.value("events", Json(kEvents));
  const auto known = [](const Json& event) {
    return event.is_string() &&
           std::ranges::find(kEvents, event.get_ref<const std::string&>()) != kEvents.end();
  };
  if (!events.is_array() || events.empty() || !std::ranges::all_of(events, known)) {
    throw InputError("'events' is a list of job.succeeded, job.failed and job.cancelled");
  }
  return events;
}

}  // namespace

Answer CreateWebhook(Services& services, const std::string& body, const std::string& idempotency_key) {
  const Json request = ParseBody(body);
  RequireFields(request, {"url", "events", "secret"}, "a webhook");
  const auto text = [&](const char* field) {
    return request.contains(field) && request[field].is_string() ? request[field].get<std::string>() : "";
  };
  RequireUrl(text("url"));
  const std::string secret = request.contains("secret") ? text("secret") : NewSecret();
  RequireSecret(secret);
  const std::string events = Dump(EventsOf(request));
  return services.idempotency.Once(KeyOf("POST /v1/webhooks", idempotency_key, {body}), [&]() -> Answer {
    const Webhook webhook = services.webhooks.Add(text("url"), secret, events);
    Json json = View(webhook);
    json["secret"] = secret;
    return {201, "/v1/webhooks/" + webhook.id, Dump(json)};
  });
}

std::string ListWebhooks(Services& services, const Query& query) {
  return Dump(PageView(services.webhooks.List(ParsePage(query))));
}

std::string GetWebhook(Services& services, const std::string& id) {
  Json json = View(services.webhooks.Require(id));
  json["deliveries"] = Json::array();
  for (const WebhookDelivery& delivery : services.webhooks.Deliveries(id, kShownDeliveries)) {
    Json item;
    item["id"] = delivery.id;
    item["type"] = delivery.type;
    item["state"] = delivery.state;
    item["attempts"] = delivery.attempt;
    item["answer"] = delivery.answer;
    item["next"] = delivery.state == "waiting" ? Json(IsoTime(delivery.next_ms)) : Json();
    item["created"] = IsoTime(delivery.created_ms);
    json["deliveries"].push_back(item);
  }
  return Dump(json);
}

void RemoveWebhook(Services& services, const std::string& id) { services.webhooks.Remove(id); }

}  // namespace kvx
