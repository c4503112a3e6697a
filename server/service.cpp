// Members in the order they are needed; they go in the opposite one.
#include "server/service.h"

#include <unistd.h>

#include <fstream>

#include "api/handlers/subjects.h"
#include "core/errors.h"
#include "server/child_inspector.h"
#include "server/janitor.h"
#include "server/log.h"
#include "server/pipeline_ports.h"
#include "server/sweep_artifacts.h"
#include "server/worker_process.h"
#include "server/workers.h"
#include "storage/data_folder.h"

namespace kvx {
namespace {

std::string Gauge(const std::string& name, const char* help, int64_t value) {
  return "# HELP " + name + " " + help + "\n# TYPE " + name + " gauge\n" + name + " " + std::to_string(value) + "\n";
}

int64_t ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  int64_t all = 0, resident = 0;
  file >> all >> resident;
  return resident * ::sysconf(_SC_PAGESIZE);
}

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
        services{catalogue, jobs, idempotency, blobs, results, audit, keys, retention, Inspector(),
                 builder, poser, resumable, webhooks, o.upload_quota_bytes},
        http(services, metrics, [this] { return NotReady(); }, o.http) {}

  std::string NotReady() {
    database.Beat();
    if (data.FreeBytes() < options.least_free_bytes) return "the disk of the data folder is nearly full";
    if (!poser.DeviceWorks()) return "the device does not compute; see its driver, then start the service again";
    return "";
  }

  std::string MoreMetrics() {
    const int64_t free_bytes = int64_t(data.FreeBytes());
    return Gauge("kinevox_device_memory_bytes", "Memory of the OpenCL device.", poser.device_memory_bytes()) +
           Gauge("kinevox_disk_free_bytes", "Free on the disk of the data folder.", free_bytes) +
           Gauge("kinevox_resident_bytes", "Memory of this process.", ResidentBytes());
  }
  ScanInspector& Inspector() { return options.program.empty() ? static_cast<ScanInspector&>(in_process) : in_child; }

  ServiceOptions options;
  DataFolder data;
  Database database;
  Catalogue catalogue{database};
  JobQueue jobs;
  Idempotency idempotency{database};
  AuditTrail audit{database};
  ApiKeys keys{database};
  BlobStore blobs;
  Retention retention{database, blobs, audit, data.uploads()};
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
  state_->metrics.more = [state = state_.get()] { return state->MoreMetrics(); };
  const int64_t memory = options.memory_bytes > 0 ? options.memory_bytes : UsualMemoryBytes();
  state_->jobs.set_memory_budget(memory);
  if (state_->data.alone()) state_->jobs.ExpireAllLeases();  // whoever held one is gone
  state_->data.LetWorkersIn();
  state_->idempotency.ForgetOlderThan(7 * kDayMs);
  state_->retention.RemoveBytes([this](const std::string& model) { RemoveModelBytes(state_->services, model); });
  SweepArtifacts(state_->data);
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
