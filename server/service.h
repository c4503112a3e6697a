// The whole service in one object: data folder, database, workers, HTTP.
#pragma once
#include <filesystem>
#include <memory>

#include "kernels/device/backend.h"
#include "server/http/http_server.h"
#include "server/webhook_sender.h"

namespace kvx {

struct ServiceOptions {
  std::filesystem::path data;
  int workers = 1;
  int64_t lease_ms = 15'000;
  int64_t memory_bytes = 0;       // that running jobs may declare together; 0: most of the machine's
  std::filesystem::path program;  // this program, to read uploads in a child process; empty: in this process
  WebhookOptions webhooks;
  int64_t result_cache_bytes = int64_t(8) << 30;
  int64_t upload_quota_bytes = int64_t(4) << 30;
  uintmax_t least_free_bytes = uintmax_t(512) << 20;  // below: not ready, and nothing new is taken
  BackendOptions backend;
  HttpOptions http;
};

class Service {
 public:
  explicit Service(const ServiceOptions& options);  // opens everything and binds
  ~Service();
  int port() const;
  void Run();   // until Stop; running jobs are given back before it returns
  void Stop();  // from any thread

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
