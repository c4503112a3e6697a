// Members in the order they are needed; they go in the opposite one.
#include "server/service.h"

#include "api/handlers/subjects.h"
#include "core/errors.h"
#include "server/log.h"
#include "server/pipeline_ports.h"
#include "server/sweep_artifacts.h"
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
        blobs(data.root()),
        results(data.results(), o.result_cache_bytes),
        builder(data, o.backend),
        poser(data, o.backend),
        services{catalogue, jobs, idempotency, blobs, results, audit, keys, retention, inspector, builder, poser, o.upload_quota_bytes},
        http(services, metrics, [this] { return NotReady(); }, o.http) {}

  std::string NotReady() {
    database.Beat();
    if (data.FreeBytes() < options.least_free_bytes) return "the disk of the data folder is nearly full";
    return "";
  }

  ServiceOptions options;
  DataFolder data;
  Database database;
  Catalogue catalogue{database};
  JobQueue jobs;
  Idempotency idempotency{database};
  AuditTrail audit{database};
  ApiKeys keys{database};
  BlobStore blobs;
  Retention retention{database, blobs, audit, data.root() / "uploads"};
  ResultCache results;
  Metrics metrics;
  PipelineInspector inspector;
  PipelineBuilder builder;
  PipelinePoser poser;
  Services services;
  HttpServer http;
};

Service::Service(const ServiceOptions& options) : state_(std::make_unique<State>(options)) {
  state_->jobs.ExpireAllLeases();  // the data folder is locked: whoever held one is gone
  state_->idempotency.ForgetOlderThan(7 * kDayMs);
  state_->retention.RemoveBytes([this](const std::string& model) { RemoveModelBytes(state_->services, model); });
  SweepArtifacts(state_->data);
}

Service::~Service() = default;

int Service::port() const { return state_->http.port(); }
const std::string& Service::device_name() const { return state_->poser.device_name(); }

void Service::Run() {
  Workers workers(state_->services, state_->metrics, state_->options.workers);
  LogInfo("listening", {{"port", int64_t(port())}, {"workers", int64_t(state_->options.workers)}});
  state_->http.Run();
  workers.Stop();
  LogInfo("stopped", {});
}

void Service::Stop() { state_->http.Stop(); }

}  // namespace kvx
