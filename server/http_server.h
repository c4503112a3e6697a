// The HTTP side of the service: sockets, limits, problem documents, the log of requests.
#pragma once
#include <functional>
#include <memory>
#include <string>

#include "api/services.h"
#include "server/metrics.h"

namespace kvx {

struct HttpOptions {
  std::string host = "127.0.0.1";
  int port = 8080;                     // 0: any free one
  int threads = 16;                    // one per open connection; streams take theirs from these
  int waiting_connections = 64;        // beyond: 503
  int event_streams = 6;               // beyond: 503
  int stream_seconds = 600;            // an event stream's longest life; clients come back with Last-Event-ID
  int heartbeat_seconds = 10;          // a comment on a quiet stream
};

bool IsLoopback(const std::string& host);  // 127.x.x.x, ::1, localhost

// Can the service work now? Empty when it can, else what is wrong.
using ReadyCheck = std::function<std::string()>;

class HttpServer {
 public:
  // Binds. Throws InputError for an address that is not loopback (there is no authentication yet), Unavailable when taken.
  HttpServer(Services& services, Metrics& metrics, ReadyCheck ready, const HttpOptions& options);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int port() const;
  void Run();   // until Stop
  void Stop();  // from any thread; requests under way are finished, event streams ended

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
