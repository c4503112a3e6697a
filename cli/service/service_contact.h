// What the requests to a service have in common: when one is sent again, whom a wait is told,
// and what refusals become. Of the client alone.
#pragma once
#include <chrono>
#include <optional>
#include <string>

#include "cli/service/patience.h"
#include "cli/service/service_client.h"
#include "cli/terminal/interrupt.h"
#include "cli/terminal/stop_on_interrupt.h"
#include "server/http_library.h"
#include "storage/ids.h"

namespace kvx {

// When to ask again where the service has no time (429), or a proxy finds no service behind it. Nothing where
// a quota is used up for longer than a minute: then it is the user's matter.
std::optional<std::chrono::seconds> BusyFor(const httplib::Response& response);

[[noreturn]] void ThrowProblem(const httplib::Response& response);
[[noreturn]] void ThrowNoAnswer(httplib::Error error);
[[noreturn]] void ThrowGivenUp(const httplib::Result& result);
ServiceJson Checked(const httplib::Result& result);
std::string ReasonToWait(const httplib::Result& result);

// What a client knows of its service, and whom it tells that it waits.
struct Contact {
  bool answered_before = false;
  WaitSink on_wait;

  // While the service is busy, and when no answer came. A service that has answered before may be starting
  // again, and is waited for; where nobody listens at first, nobody does.
  bool WorthAnotherTry(const httplib::Result& result);
  // Pauses after this result; what is more than a moment is told. False: no more patience.
  bool Wait(Patience& patience, const httplib::Result& result) const;
};

// What is sent here ends with Ctrl-C, without a result: an answer may take minutes.
template <class Send>
httplib::Result UntilInterrupted(httplib::Client& http, const Send& send) {
  ThrowIfInterrupted();
  const StopOnInterrupt stopper([&http] { http.stop(); }, StopOnInterrupt::Stops::kUntilItEnds);
  return send();
}

// Sends again what is worth another try: it has a key, or changes nothing, or nothing more.
template <class Send>
httplib::Result SendPatiently(httplib::Client& http, Contact& contact, const Send& send) {
  httplib::Result result = UntilInterrupted(http, send);
  Patience patience;
  while (!InterruptRequested()) {
    if (!contact.WorthAnotherTry(result) || !contact.Wait(patience, result)) return result;
    result = UntilInterrupted(http, send);
  }
  if (!result || BusyFor(*result)) throw Cancelled();
  return result;
}

struct ServiceClient::State {
  explicit State(const std::string& url) : http(url) {}
  template <class Send>
  httplib::Result SendPatiently(const Send& send) {
    return kvx::SendPatiently(http, contact, send);
  }
  // Under a key, of its own where the caller has none.
  template <class Send>
  httplib::Result SendKeyed(const std::string& key, const Send& send) {
    const httplib::Headers headers{{"Idempotency-Key", key.empty() ? NewId("key") : key}};
    return SendPatiently([&] { return send(headers); });
  }
  httplib::Client http;
  Contact contact;
};

}  // namespace kvx
