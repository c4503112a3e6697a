// cpp-httplib with its open ends closed: docs/dependencies.md says which.
#include "server/http/http_server.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <thread>
#include <type_traits>

#include "server/address.h"
#include "server/http/bounded_pool.h"
#include "server/http/http_context.h"
#include "server/http/known_paths.h"
#include "server/log.h"
#include "server/ports/device_errors.h"
#include "storage/ids.h"

namespace kvx {
namespace {

using httplib::Request;
using httplib::Response;
using Handled = httplib::Server::HandlerResponse;

constexpr auto kLookEvery = std::chrono::milliseconds(200);  // for connections that are too slow
constexpr auto kLookForEndEvery = std::chrono::milliseconds(20);
constexpr char kStopping[] = "the service is stopping";

bool IsChunked(const Request& request) { return request.has_header("Transfer-Encoding"); }

uint64_t AnnouncedBytes(const Request& request) { return request.get_header_value_u64("Content-Length"); }

bool AnnouncesBody(const Request& request) { return IsChunked(request) || AnnouncedBytes(request) > 0; }

// Piece by piece, once it is known who sends it. Any other body the library would read into memory before.
bool HasReader(const Request& request) {
  const bool reads = request.method == "POST" || request.method == "PUT" || request.method == "PATCH";
  return reads && MethodsAt(request.path).find(request.method) != std::string::npos;
}

// What some clients send without need: it is not read, and does no harm.
bool IsSmall(const Request& request) {
  constexpr uint64_t kHarmless = 64 << 10;
  return !IsChunked(request) && AnnouncedBytes(request) <= kHarmless;
}

// For the library there is none then. The connection ends with the answer.
void ForgoBody(const Request& request, ConnectionWatch::Request& watched) {
  watched.ForgoBody(AnnouncedBytes(request));
  auto& headers = const_cast<Request&>(request).headers;
  for (const char* name : {"Content-Length", "Transfer-Encoding"}) headers.erase(name);
  headers.emplace("Content-Length", "0");
  CloseAfterwards(request);
}

void RefuseBody(const Request& request, Response& response) {
  const std::string allowed = MethodsAt(request.path);
  if (!allowed.empty() && allowed.find(request.method) == std::string::npos)
    AnswerWrongMethod(request, response);
  else
    SendProblem(response, ProblemOfStatus(allowed.empty() ? 404 : 413));
}

// The library would read what a handler has left of a body, however long that takes, and would keep
// connections whose end it has told.
void EndWithAnswer(const Request& request, Response& response) {
  ConnectionWatch::Request* watched = WatchedRequest(response);
  if (!watched) return;
  if (AnnouncesBody(request) && !request.body_consumed_) watched->ForgoBody(AnnouncedBytes(request));
  if (watched->ForgoesBody()) {
    const_cast<Request&>(request).body_consumed_ = true;
    response.headers.erase("Keep-Alive");
    response.headers.erase("Connection");
    response.set_header("Connection", "close");
  }
  if (response.get_header_value("Connection") == "close") watched->Leave(request.ssl);
  watched->Answer(response.body.size());
}

// RFC 9110, 14.2: only files have ranges (SendFile takes them up); everything else is sent whole. The library
// would pick the bytes of any answer, also of one that says what was made.
void LeaveRangesToFiles(const Request& request) { const_cast<Request&>(request).ranges.clear(); }

// RFC 9110, 8.6: none with 204; with 304 it would be the length of the file. The library adds a 0.
void LeaveOutLengthOfNothing(Response& response) {
  if (response.status == 204 || response.status == 304) response.headers.erase("Content-Length");
}

// RFC 9110, 9.3.2: HEAD says what GET would. The library promises ranges of everything; files alone have a
// name to be saved by, and ranges.
void PromiseRangesOfFiles(Response& response) {
  if (!response.has_header("Content-Disposition")) response.headers.erase("Accept-Ranges");
}

// The library refuses these headers before anybody else sees the request.
std::optional<std::string> UnreadHeader(const Request& request, const Response& response) {
  const int status = response.status;
  std::vector<std::string> types;
  if (status == 400 && !httplib::detail::parse_accept_header(request.get_header_value("Accept"), types))
    return "the Accept header is no list of media types such as 'application/json, text/csv;q=0.5'; empty "
           "elements and weights above 1 are not taken";
  httplib::Ranges ranges;
  if (status == 416 && !httplib::detail::parse_range_header(request.get_header_value("Range"), ranges))
    return "the Range header is not bytes=FIRST-LAST; leave it out for the whole";
  const bool read = response.has_header("X-Request-Id");  // the headers, as far as that
  const bool two_lengths = request.has_header("Content-Length") && request.has_header("Transfer-Encoding");
  if (status == 400 && !read && !two_lengths && !request.path.empty())
    return "a header line is malformed or longer than 8 KiB, or there are more than 100; send fewer and "
           "shorter ones";
  return std::nullopt;
}

// TRACE, PROPFIND and what nobody has heard of: for the library no HTTP.
bool IsOtherMethod(const Request& request) {
  constexpr std::array<std::string_view, 7> kTaken{"GET",   "HEAD",   "POST",   "PUT",
                                                   "PATCH", "DELETE", "OPTIONS"};
  return request.version.starts_with("HTTP/1.") && std::ranges::find(kTaken, request.method) == kTaken.end();
}

// Answers that the library makes by itself.
void DescribeError(const Request& request, Response& response) {
  if (!response.has_header("traceparent")) response.set_header("traceparent", TraceParent(request));
  if (response.status == 416) ForgetFile(response);
  if (response.status == 404 && request.matched_route.empty()) AnswerWrongMethod(request, response);
  if (!response.body.empty()) return;
  if (response.status == 400 && IsOtherMethod(request)) AnswerWrongMethod(request, response);
  if (!response.body.empty()) return;
  Problem problem = ProblemOfStatus(response.status);
  if (request.matched_route.empty())
    problem.detail = UnreadHeader(request, response).value_or(problem.detail);
  SendProblem(response, problem);
}

Handled BeforeRouting(HttpContext& context, const Request& request, Response& response) {
  ConnectionWatch::Request& watched = WatchRequest(response);
  if (ConnectionWatch::Left()) {
    SendProblem(response, ProblemOfStatus(400));
    return Handled::Handled;
  }
  ReadAsMeant(request);
  response.set_header("X-Request-Id", NewId("req"));
  response.set_header("traceparent", TraceParent(request));
  if (BoundedPool::TurningAway()) {
    CloseAfterwards(request);
    SendProblem(response, ProblemOfStatus(503));
    return Handled::Handled;
  }
  LeaveRangesToFiles(request);
  if (BoundedPool::OthersWait()) CloseAfterwards(request);  // this client comes back behind them
  if (AnnouncesBody(request) && !HasReader(request)) {
    const bool small = IsSmall(request);
    ForgoBody(request, watched);
    if (!small) {
      RefuseBody(request, response);
      return Handled::Handled;
    }
  }
  if (const auto refusal = Refusal(request, context.options)) {
    SendProblem(response, *refusal);
    return Handled::Handled;
  }
  if (AnswerPreflight(request, response, context.options)) return Handled::Handled;
  if (context.stopping) throw Unavailable(kStopping);
  return Handled::Unhandled;
}

void OnException(const Request& request, Response& response, std::exception_ptr error) try {
  const std::exception_ptr known = AsOurKind(error);
  const Problem problem = ToProblem(known);
  if (problem.status == 500 || known != error) {
    LogError("request failed", {{"request", response.get_header_value("X-Request-Id")},
                                {"route", request.matched_route},
                                {"error", DescribeForLog(known)}});
  }
  SendProblem(response, problem);
} catch (...) {  // no memory for words
  response.status = 503;
}

void LogRequest(HttpContext& context, const Request& request, const Response& response) {
  context.metrics.CountResponse(response.status);
  const auto took = std::chrono::steady_clock::now() - request.start_time_;
  const bool routed = !request.matched_route.empty();
  context.metrics.requests.Observe("method=\"" + (routed ? request.method : "-") + "\",route=\"" +
                                       (routed ? request.matched_route : "-") + "\"",
                                   std::chrono::duration<double>(took).count());
  LogInfo("request", {{"request", response.get_header_value("X-Request-Id")},
                      {"trace", response.get_header_value("traceparent")},
                      {"method", request.matched_route.empty() ? "-" : request.method},
                      {"route", request.matched_route.empty() ? "-" : request.matched_route},
                      {"status", int64_t(response.status)},
                      {"ms", std::chrono::duration<double, std::milli>(took).count()}});
}

// 100 where the body may come.
int AnswerBeforeBody(HttpContext& context, const Request& request, Response& response) try {
  if (AnnouncesBody(request) && !IsSmall(request) && !HasReader(request)) {
    RefuseBody(request, response);
    return response.status;
  }
  RequireRoomFor(request, context.services.upload_quota_bytes);
  return 100;
} catch (...) {
  OnException(request, response, std::current_exception());
  return response.status;
}

// Unlike the library's default no SO_REUSEPORT: two services must not share a port unnoticed.
void SocketOptions(socket_t socket) {
  const int yes = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
}

void Configure(httplib::Server& http, HttpContext& context) {
  http.new_task_queue = [&context] {
    return new BoundedPool(context.options.threads, size_t(context.options.waiting_connections),
                           [&context](size_t waiting) {
                             context.connections.EndSlow(waiting);
                             if (context.Drained()) context.connections.EndAll();
                           });
  };
  http.set_idle_interval(kLookEvery);
  http.set_socket_options(SocketOptions);
  http.set_tcp_nodelay(true);
  http.set_keep_alive_timeout(2);  // an idle connection holds a thread
  // Nobody else has so long: ConnectionWatch ends those whom nobody knows
  http.set_read_timeout(context.options.pause_seconds);
  http.set_write_timeout(context.options.pause_seconds);
  http.set_payload_max_length(size_t(context.services.upload_quota_bytes) + kBodySlack);
  http.set_expect_100_continue_handler(
      [&](const Request& q, Response& r) { return AnswerBeforeBody(context, q, r); });
  http.set_pre_routing_handler([&](const Request& q, Response& r) { return BeforeRouting(context, q, r); });
  http.set_pre_request_handler([&](const Request& q, Response& r) {
    Admit(context, q, r);
    RequireKnownParameters(q);
    if (context.stopping) throw Unavailable(kStopping);  // again: Stop waits for those that were let in
    return Handled::Unhandled;
  });
  http.set_post_routing_handler([&](const Request& q, Response& r) {
    EndWithAnswer(q, r);
    LeaveOutLengthOfNothing(r);
    PromiseRangesOfFiles(r);
    AddCommonHeaders(q, r, context.options);
    Audit(context, q, r);
  });
  http.set_exception_handler(OnException);
  http.set_error_handler(DescribeError);
  http.set_logger([&](const Request& q, const Response& r) { LogRequest(context, q, r); });
}

// Beyond loopback everybody can reach it: who asks must be known, and nobody on the way may read along.
void RequireSafe(const HttpOptions& options) {
  if (options.tls_certificate.empty() != options.tls_key.empty()) {
    throw InputError("TLS needs a certificate and its key, both as PEM files");
  }
  if (IsLoopback(options.host)) return;
  if (!options.access.On()) {
    throw InputError(
        "without authentication the service listens on loopback only: turn API keys or OIDC on, or use "
        "127.0.0.1");
  }
  if (!options.Tls() && !options.behind_proxy) {
    throw InputError(
        "without TLS the service listens on loopback only: give a certificate and its key, or say that a "
        "proxy with TLS stands in front (behind_proxy)");
  }
}

// The library's own, whose connections are watched. That they can be is cmake/KvxDependencies.cmake's doing.
template <class Base>
class Watched final : public Base {
 public:
  template <class... Arguments>
  explicit Watched(ConnectionWatch& watch, Arguments... arguments) : Base(arguments...), watch_(watch) {}

 private:
  // Of a connection over TLS the library closes what failed itself.
  bool process_and_close_socket(socket_t socket) override {
    bool closes = true;
    try {
      const ConnectionWatch::Connection watched(watch_, socket);
      closes = std::is_same_v<Base, httplib::Server>;
      return Base::process_and_close_socket(socket);
    } catch (...) {
      if (closes) ::close(socket);
      throw;
    }
  }
  ConnectionWatch& watch_;
};

std::unique_ptr<httplib::Server> MakeServer(const HttpOptions& options, ConnectionWatch& watch) {
  if (!options.Tls()) return std::make_unique<Watched<httplib::Server>>(watch);
  auto server = std::make_unique<Watched<httplib::SSLServer>>(watch, options.tls_certificate.c_str(),
                                                              options.tls_key.c_str());
  if (!server->is_valid())
    throw InputError("the TLS certificate or its key cannot be used; both are PEM files");
  SSL_CTX_set_min_proto_version(static_cast<SSL_CTX*>(server->tls_context()), TLS1_2_VERSION);
  return server;
}

}  // namespace

struct HttpServer::State {
  HttpContext context;
  std::unique_ptr<httplib::Server> http;
  int port = 0;
};

HttpServer::HttpServer(Services& services, Metrics& metrics, ReadyCheck ready, const HttpOptions& options)
    : state_(new State{{services, metrics, std::move(ready), options,
                        Access(services.keys, options.access, SystemClockMs)},
                       nullptr,
                       0}) {
  RequireSafe(options);
  state_->http = MakeServer(options, state_->context.connections);
  Configure(*state_->http, state_->context);
  AddRoutes(*state_->http, state_->context);
  const std::string host = options.host == "localhost" ? "127.0.0.1" : options.host;
  state_->port = options.port;
  if (options.port == 0)
    state_->port = state_->http->bind_to_any_port(host);
  else if (!state_->http->bind_to_port(host, options.port))
    state_->port = -1;
  if (state_->port <= 0)
    throw Unavailable("the address is taken or cannot be used; give another with --listen");
}

HttpServer::~HttpServer() = default;

int HttpServer::port() const { return state_->port; }

void HttpServer::Run() {
  if (!state_->http->listen_after_bind() && !state_->context.stopping)
    throw Unavailable("connections can no longer be accepted; start the service again");
}

bool HttpServer::Drained() const { return state_->context.Drained(); }

void HttpServer::Stop() {
  state_->context.drained_at =
      std::chrono::steady_clock::now() + std::chrono::seconds(state_->context.options.drain_seconds);
  state_->context.stopping = true;
  state_->context.services.jobs.WakeAll();
  state_->http->wait_until_ready();
  // The library cuts answers off as soon as it stops
  while (!state_->context.Drained() && state_->context.connections.Served() > 0)
    std::this_thread::sleep_for(kLookForEndEvery);
  state_->http->stop();
}

}  // namespace kvx
