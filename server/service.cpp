// Members in the order they are needed; they go in the opposite one.
#include "server/service.h"

#include "core/errors.h"
#include "server/child_inspector.h"
#include "server/janitor.h"
#include "server/log.h"
#include "server/pipeline_ports.h"
#include "server/worker_process.h"
#include "server/workers.h"
#include "storage/data_folder.h"

namespace kvx {
namespace {
constexpr int64_t kDayMs = 24 * 3600 * int64_t(1000);
}

struct Service::State {
  explicit State(const ServiceOptions& o)
      : options(o),
        data(o.data),
        database(data.database()),
        jobs(database, o.lease_ms),
        blobs(data.root(), data.alone()),
        results(data.results(), o.result_cache_bytes),
        resumable(database, data.uploads()),
        in_child(o.program),
        builder(data, o.backend),
        poser(data, o.backend),
        services{catalogue, jobs,    idempotency, blobs,     results, Inspector(),
                 builder,   poser, resumable,   webhooks, o.upload_quota_bytes},
        http(services, metrics, [this] { return NotReady(); }, o.http) {}

  std::string NotReady() {
    database.Beat();
    if (data.FreeBytes() < options.least_free_bytes) return "the disk of the data folder is nearly full";
    return "";
  }

  ScanInspector& Inspector() { return options.program.empty() ? static_cast<ScanInspector&>(in_process) : in_child; }

  ServiceOptions options;
  DataFolder data;
  Database database;
  Catalogue catalogue{database};
  JobQueue jobs;
  Idempotency idempotency{database};
  BlobStore blobs;
  ResultCache results;
  ResumableUploads resumable;
  WebhookOutbox webhooks{database};
  Metrics metrics;
  PipelineInspector in_process;
  ChildInspector in_child;
  PipelineBuilder builder;
  PipelinePoser poser;
  Services services;
  HttpServer http;
};

Service::Service(const ServiceOptions& options) : state_(std::make_unique<State>(options)) {
  const int64_t memory = options.memory_bytes > 0 ? options.memory_bytes : UsualMemoryBytes();
  state_->jobs.set_memory_budget(memory);
  if (state_->data.alone()) state_->jobs.ExpireAllLeases();  // whoever held one is gone
  state_->data.LetWorkersIn();
  state_->idempotency.ForgetOlderThan(7 * kDayMs);
}

Service::~Service() = default;

int Service::port() const { return state_->http.port(); }
const std::string& Service::device_name() const { return state_->poser.device_name(); }

void Service::Run() {
  Workers workers(state_->services, state_->metrics, state_->options.workers);
  Janitor janitor(state_->services);
  WebhookSender sender(state_->webhooks, state_->options.webhooks);
  LogInfo("listening", {{"port", int64_t(port())}, {"workers", int64_t(state_->options.workers)}});
  state_->http.Run();
  workers.Stop();
  LogInfo("stopped", {});
}

void Service::Stop() { state_->http.Stop(); }

}  // namespace kvx
