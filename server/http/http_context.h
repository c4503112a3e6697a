// What the routes of one server share, and the answers they give. Inside server/ only: HTTP library types.
#pragma once
#include <atomic>
#include <chrono>

#include "api/errors.h"
#include "api/handlers/pose_query.h"
#include "server/access/access.h"
#include "server/http/connection_watch.h"
#include "server/http/http_server.h"
#include "server/http_library.h"
#include "server/jobs/job_watch.h"
#include "server/turns/posing_gate.h"
#include "storage/project_shares.h"

namespace kvx {

struct HttpContext {
  Services& services;
  Metrics& metrics;
  ReadyCheck ready;
  HttpOptions options;
  Access access;
  JobWatch job_watch{services.jobs, metrics};
  ConnectionWatch connections{std::chrono::seconds(options.header_seconds)};
  PosingGate readings{1, 16};  // of label maps and scans, whole: each takes memory and a core
  ProjectShares large_bodies{8, options.access.On()};  // kept in memory at the same time
  PosingGate parsing{1, 8};                            // of large bodies: JSON takes several times its size
  ProjectShares streams{options.event_streams, options.access.On()};  // and waits: a thread each
  RateLimiter refusals{SystemClockMs};  // of entries in the audit trail that anybody can cause
  std::atomic<bool> stopping{false};
  std::chrono::steady_clock::time_point
      drained_at;  // set before `stopping`: bodies are not read or sent beyond

  bool Drained() const { return stopping && std::chrono::steady_clock::now() > drained_at; }
};

// What was found out about a request before its handler runs; kept with the response.
struct RequestScope {
  Identity identity;
  ProjectServices project;
  std::vector<std::string> objects;
};
// What the watch of its connection has to know of a request; kept with the response.
ConnectionWatch::Request& WatchRequest(httplib::Response& response);  // its first call begins it
ConnectionWatch::Request* WatchedRequest(
    httplib::Response& response);  // null where the library answers alone
// The services as the project of this request sees them. Throws when the route was not admitted.
Services& ServicesOf(httplib::Response& response);
const Identity& IdentityOf(httplib::Response& response);
// For the audit trail: what the request is about and no address of it or its answer says.
void NameObject(httplib::Response& response, const std::string& id);

// What the standards say of a request and the library does not take up, written into it.
void ReadAsMeant(const httplib::Request& request);
void CloseAfterwards(const httplib::Request& request);

// Between routing and handler: who asks, may they, is their quota used up.
// Throws what the client gets as a problem.
void Admit(HttpContext& context, const httplib::Request& request, httplib::Response& response);
// One entry of the audit trail for a request that changed something or was refused,
// before its answer is sent.
void Audit(HttpContext& context, const httplib::Request& request, httplib::Response& response);

void AddRoutes(httplib::Server& http, HttpContext& context);
void AddApiPage(httplib::Server& http);  // /docs
void AddUploadRoutes(httplib::Server& http, HttpContext& context);

// Answers.
void SendJson(httplib::Response& response, int status, std::string body);
void SendAnswer(httplib::Response& response, const Answer& answer);
void SendProblem(httplib::Response& response, const Problem& problem);
void SendFile(const httplib::Request& request, httplib::Response& response, const FileAnswer& answer);
// Of a file whose range was asked for in vain, only its size is told.
void ForgetFile(httplib::Response& response);
// 405 where the address takes other methods.
void AnswerWrongMethod(const httplib::Request& request, httplib::Response& response);
// GET /v1/jobs/{j}?wait=SECONDS&after=EVENT:
// answers once something has happened after the event, or the time is up.
std::string WaitForJob(const httplib::Request& request, httplib::Response& response, HttpContext& context);
void SendJobEvents(const httplib::Request& request, httplib::Response& response, HttpContext& context,
                   const std::string& job);

// Requests.
Query QueryOf(const httplib::Request& request);
std::string KeyIn(const httplib::Request& request);  // Idempotency-Key, or empty
// Throws InputError for any parameter below /v1/ where the API's document has none. Where it has some,
// handlers know them.
void RequireKnownParameters(const httplib::Request& request);
Conditions ConditionsOf(const httplib::Request& request);  // refers to the request
// Throws BodyTooLarge. `admit_large` is asked once a body is large; false ends the reading as Unavailable.
std::string ReadBody(const httplib::ContentReader& reader, size_t limit_bytes,
                     const std::function<bool()>& admit_large = {});
constexpr size_t kLargeBody = 1 << 20;
// A body from which a document is made in memory. Of large ones there are few, until they are answered, and
// they are worked on one after the other, but for what waits for others: for that they step aside.
struct WholeBody {
  std::string text;
  std::function<std::shared_ptr<void>()> take_turn{};  // empty: it is not large
  std::shared_ptr<void> turn{};
  void StepAside() { turn.reset(); }
  void StepBack() {
    if (take_turn) turn = take_turn();
  }
};
WholeBody ReadWhole(HttpContext& context, httplib::Response& response, const httplib::ContentReader& reader,
                    size_t limit_bytes);
// Whether a body comes so slowly that it is there to hold a thread: less than a KiB a second, from some
// seconds on.
class BodyPace {
 public:
  explicit BodyPace(int seconds) : seconds_(seconds) {}
  bool TooSlow(size_t more_bytes);

 private:
  const std::chrono::seconds seconds_;
  const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  size_t bytes_ = 0;
};
// Empty, or the problem of a request that no handler may see: broken header values, encoded or multipart
// bodies, foreign hosts and origins (a page in a browser must not reach a service that asks for no token).
std::optional<Problem> Refusal(const httplib::Request& request, const HttpOptions& options);

// Throws BodyTooLarge for a body that is announced to be larger than any that is taken.
void RequireRoomFor(const httplib::Request& request, int64_t most_bytes);
constexpr size_t kBodySlack = 1 << 20;  // beyond the limit: whoever reads the body can say more

// Headers.
bool AllowedOrigin(const httplib::Request& request,
                   const HttpOptions& options);  // of another origin, by configuration
bool AnswerPreflight(const httplib::Request& request, httplib::Response& response,
                     const HttpOptions& options);
void AddCommonHeaders(const httplib::Request& request, httplib::Response& response,
                      const HttpOptions& options);
// The caller's W3C trace, or a new one, with a span of ours.
std::string TraceParent(const httplib::Request& request);
std::string HttpDate(int64_t utc_ms);  // "Sun, 06 Nov 1994 08:49:37 GMT"

}  // namespace kvx
