// The address is looked up once, judged, and then connected to: a name cannot turn private between the two.
#include "server/webhook_sender.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <openssl/hmac.h>

#include <array>
#include <chrono>
#include <memory>

#include "core/errors.h"
#include "core/text/base64.h"
#include "server/address.h"
#include "server/http_library.h"
#include "server/log.h"

namespace kvx {
namespace {

// The schedule that https://www.standardwebhooks.com recommends.
constexpr std::array<int64_t, 9> kDelaysSeconds{5, 300, 1800, 7200, 18000, 36000, 50400, 72000, 86400};
constexpr size_t kLongestAnswer = 64 << 10;
constexpr int kThreads = 4;
constexpr auto kLookAgainAfter = std::chrono::milliseconds(500);

// One numeric address of the host that may be sent to. Throws Unavailable, or InputError for what never may.
std::string AddressOf(const std::string& host, bool allow_private) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  if (::getaddrinfo(host.c_str(), nullptr, &hints, &found) != 0)
    throw Unavailable("the host's name is not known");
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> all(found, ::freeaddrinfo);
  char text[INET6_ADDRSTRLEN] = "";
  for (const addrinfo* each = found; each; each = each->ai_next) {
    if (!allow_private && !IsPublicAddress(*each->ai_addr)) {
      throw InputError("the address is private; the service's configuration does not allow it");
    }
    if (text[0]) continue;
    const void* bytes =
        each->ai_family == AF_INET
            ? static_cast<const void*>(&reinterpret_cast<const sockaddr_in*>(each->ai_addr)->sin_addr)
            : &reinterpret_cast<const sockaddr_in6*>(each->ai_addr)->sin6_addr;
    ::inet_ntop(each->ai_family, bytes, text, sizeof text);
  }
  return text;
}

// Empty when the receiver took it, else what happened. Redirects are not followed: they could lead anywhere.
std::string Deliver(const WebhookMessage& message, const WebhookOptions& options) {
  const UrlParts place = SplitUrl(message.url);
  const std::string address = AddressOf(place.host, options.allow_private_addresses);
  httplib::Client http(place.origin);
  if (!http.is_valid()) return "the address cannot be used";
  http.set_hostname_addr_map({{place.host, address}});
  http.set_connection_timeout(options.timeout_seconds);
  http.set_read_timeout(options.timeout_seconds);
  http.set_write_timeout(options.timeout_seconds);
  http.set_max_timeout(std::chrono::seconds(options.timeout_seconds));  // all together
  http.set_payload_max_length(kLongestAnswer);
  const int64_t now =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch())
          .count();
  const httplib::Headers headers{
      {"webhook-id", message.id},
      {"webhook-timestamp", std::to_string(now)},
      {"webhook-signature", WebhookSignature(message.secret, message.id, now, message.body)},
      {"User-Agent", "kinevox"}};
  const auto result = http.Post(place.path, headers, message.body, "application/json");
  if (!result) return "no answer";
  return result->status / 100 == 2 ? "" : "answered with status " + std::to_string(result->status);
}

bool IsPublic4(uint32_t address) {
  struct Range {
    uint32_t start;
    int bits;
  };
  // Special-purpose addresses (RFC 6890), multicast and what lies above.
  constexpr Range kRanges[] = {{0x00000000, 8},  {0x0a000000, 8},  {0x64400000, 10}, {0x7f000000, 8},
                               {0xa9fe0000, 16}, {0xac100000, 12}, {0xc0000000, 24}, {0xc0000200, 24},
                               {0xc0a80000, 16}, {0xc6120000, 15}, {0xc6336400, 24}, {0xcb007100, 24},
                               {0xe0000000, 3}};
  for (const Range& range : kRanges) {
    if ((address >> (32 - range.bits)) == (range.start >> (32 - range.bits))) return false;
  }
  return true;
}

}  // namespace

bool IsPublicAddress(const sockaddr& address) {
  if (address.sa_family == AF_INET)
    return IsPublic4(ntohl(reinterpret_cast<const sockaddr_in&>(address).sin_addr.s_addr));
  if (address.sa_family != AF_INET6) return false;
  const uint8_t* b = reinterpret_cast<const sockaddr_in6&>(address).sin6_addr.s6_addr;
  const auto embedded = [&](int at) {
    return uint32_t(b[at]) << 24 | uint32_t(b[at + 1]) << 16 | uint32_t(b[at + 2]) << 8 | b[at + 3];
  };
  const in6_addr& six = reinterpret_cast<const sockaddr_in6&>(address).sin6_addr;
  if (IN6_IS_ADDR_V4MAPPED(&six)) return IsPublic4(embedded(12));
  if (b[0] == 0x20 && b[1] == 0x02) return IsPublic4(embedded(2));  // 6to4
  if (b[0] == 0x20 && b[1] == 0x01 && b[2] < 0x02) return false;    // Teredo and other special purposes
  if (b[0] == 0x20 && b[1] == 0x01 && b[2] == 0x0d && b[3] == 0xb8) return false;  // documentation
  return (b[0] & 0xe0) == 0x20;  // global unicast is 2000::/3
}

int64_t WebhookDelaySeconds(int64_t failed_attempts) {
  if (failed_attempts < 1 || size_t(failed_attempts) > kDelaysSeconds.size()) return 0;
  return kDelaysSeconds[size_t(failed_attempts - 1)];
}

std::string WebhookSignature(const std::string& secret, const std::string& id, int64_t timestamp,
                             const std::string& body) {
  const std::optional<std::string> key = FromBase64(std::string_view(secret).substr(secret.find('_') + 1));
  if (!key) throw InputError("the webhook's secret is not base64");
  const std::string text = id + "." + std::to_string(timestamp) + "." + body;
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned size = 0;
  HMAC(EVP_sha256(), key->data(), int(key->size()), reinterpret_cast<const unsigned char*>(text.data()),
       text.size(), digest, &size);
  return "v1," + Base64({reinterpret_cast<const char*>(digest), size});
}

WebhookSender::WebhookSender(WebhookOutbox& outbox, const WebhookOptions& options)
    : outbox_(outbox), options_(options) {
  try {
    for (int i = 0; i < kThreads; ++i) threads_.emplace_back([this] { Run(); });
  } catch (...) {  // the system gives no more threads
    Stop();
    throw;
  }
}

void WebhookSender::Stop() {
  stopping_ = true;
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

void WebhookSender::Run() {
  while (!stopping_) {
    bool sent = false;
    try {
      sent = SendOne();
    } catch (...) {
      LogError("webhooks", {{"error", DescribeForLog(std::current_exception())}});
    }
    if (!sent) std::this_thread::sleep_for(kLookAgainAfter);
  }
}

std::optional<WebhookMessage> WebhookSender::Take() {
  const std::lock_guard lock(mutex_);
  for (size_t busy = 0; busy <= sent_for_.size(); ++busy) {
    auto message = outbox_.NextDue(served_last_);
    if (!message) return std::nullopt;
    served_last_ = message->project;
    if (sent_for_.insert(message->project).second) return message;
  }
  return std::nullopt;
}

void WebhookSender::GiveBack(const std::string& project) {
  const std::lock_guard lock(mutex_);
  sent_for_.erase(project);
}

bool WebhookSender::SendOne() {
  const auto message = Take();
  if (!message) return false;
  const std::shared_ptr<void> taken(nullptr, [&](void*) { GiveBack(message->project); });
  std::string trouble;
  bool hopeless = false;
  try {
    trouble = Deliver(*message, options_);
  } catch (const InputError& refused) {
    trouble = refused.what();
    hopeless = true;
  } catch (const Error& error) {
    trouble = error.what();
  }
  const int64_t delay = hopeless ? 0 : WebhookDelaySeconds(message->attempt + 1);
  if (trouble.empty())
    outbox_.Delivered(message->id, "taken");
  else if (delay > 0)
    outbox_.Postpone(message->id, delay * 1000, trouble);
  else
    outbox_.GiveUp(message->id, trouble);
  LogInfo("webhook", {{"message", message->id}, {"outcome", trouble.empty() ? "taken" : trouble}});
  return true;
}

}  // namespace kvx
