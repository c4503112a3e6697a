// The HTTP side of the service: sockets, limits, problem documents, the log of requests.
#pragma once
#include <functional>
#include <memory>
#include <string>

#include "api/services.h"
#include "server/access/access.h"
#include "server/metrics.h"

namespace kvx {

struct HttpOptions {
  std::string host = "127.0.0.1";
  int port = 8080;               // 0: any free one
  int threads = 512;             // at most: one per open connection, streams too
  int waiting_connections = 64;  // beyond: 503
  int header_seconds = 15;       // that a connection has to say what it wants; less where others wait
  int slow_body_seconds = 60;    // an upload that is slower than 1 KiB/s for that long is given up
  int pause_seconds = 60;        // that who was let in may send or take nothing, amid a body or an answer
  int event_streams = 64;        // and waits for a job, a share of each project; beyond: 503
  int stream_seconds = 600;      // an event stream's longest life; clients come back with Last-Event-ID
  int heartbeat_seconds = 10;    // a comment on a quiet stream
  int drain_seconds = 20;        // a stop waits that long for requests under way
  AccessOptions access;
  std::string tls_certificate, tls_key;  // PEM files; both or none
  bool behind_proxy = false;             // TLS ends in a proxy in front of this service
  std::vector<std::string>
      hosts;  // names it answers to beyond loopback; with authentication and none given: any
  std::vector<std::string>
      cors_origins;          // other origins whose pages may use the service: "https://viewer.example"
  bool audit_reads = false;  // reading goes into the audit trail too
  bool Tls() const { return !tls_certificate.empty(); }
};

// Can the service work now? Empty when it can, else what is wrong.
using ReadyCheck = std::function<std::string()>;

class HttpServer {
 public:
  // Binds. Throws InputError for options that would leave the service open,
  // Unavailable when the address is taken.
  HttpServer(Services& services, Metrics& metrics, ReadyCheck ready, const HttpOptions& options);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int port() const;
  void Run();  // until Stop; throws Unavailable when no connection can be accepted any more
  // From any thread: nothing new is taken, event streams end. Waits for answers under way, drain_seconds at
  // most; then connections are closed.
  void Stop();
  bool Drained() const;  // the time for answers under way is up

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
