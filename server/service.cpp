// Members in the order they are needed; they go in the opposite one.
#include "server/service.h"

#include <unistd.h>

#include <fstream>
#include <stop_token>

#include "api/handlers/subjects.h"
#include "core/host/parallel.h"
#include "core/version.h"
#include "server/janitor.h"
#include "server/jobs/worker_process.h"
#include "server/jobs/workers.h"
#include "server/log.h"
#include "server/ports/child_inspector.h"
#include "server/ports/pipeline_ports.h"
#include "server/sweep_artifacts.h"

namespace kvx {
namespace {

int64_t ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  int64_t all = 0, resident = 0;
  file >> all >> resident;
  return resident * ::sysconf(_SC_PAGESIZE);
}

}  // namespace

struct Service::State {
  explicit State(const ServiceOptions& o)
      : options(o),
        stores(o.data, {.lease_ms = o.lease_ms,
                        .memory_bytes = o.memory_bytes > 0 ? o.memory_bytes : UsualMemoryBytes(),
                        .result_bytes = o.result_cache_bytes,
                        .least_free_bytes = o.least_free_bytes}),
        in_child(o.program, {}, [this] { return http.Drained(); }),
        builder(stores.data, o.backend),
        poser(stores.data, o.backend),
        services(ServicesOver(stores, Inspector(), builder, poser, o.upload_quota_bytes)),
        http(
            services, metrics, [this] { return NotReady(); }, o.http) {}

  std::string NotReady() {
    stores.database.Beat();
    if (const std::string full = FullDisk(services); !full.empty()) return full;
    if (!poser.DeviceWorks())
      return "the device does not compute; see its driver, then start the service again";
    return "";
  }

  std::string MoreMetrics() {
    const int64_t free_bytes = int64_t(stores.data.FreeBytes());
    return Figure("kinevox_device_memory_bytes", "gauge", "Memory of the OpenCL device.",
                  poser.device_memory_bytes()) +
           Figure("kinevox_disk_free_bytes", "gauge", "Free on the disk of the data folder.", free_bytes) +
           Figure("kinevox_resident_bytes", "gauge", "Memory of this process.", ResidentBytes());
  }
  ScanInspector& Inspector() {
    return options.program.empty() ? static_cast<ScanInspector&>(in_process) : in_child;
  }

  ServiceOptions options;
  Stores stores;
  Metrics metrics;
  PipelineInspector in_process;
  ChildInspector in_child;
  PipelineBuilder builder;
  PipelinePoser poser;
  Services services;
  HttpServer http;
  std::stop_source stop;
};

Service::Service(const ServiceOptions& options) : state_(std::make_unique<State>(options)) {
  state_->metrics.more = [state = state_.get()] { return state->MoreMetrics(); };
  Stores& stores = state_->stores;
  if (stores.data.alone()) stores.jobs.ExpireAllLeases();  // whoever held one is gone
  stores.data.LetWorkersIn();
  stores.idempotency.ForgetOlderThan(7 * kDayMs);
  SweepArtifacts(stores.data);
}

Service::~Service() = default;

int Service::port() const { return state_->http.port(); }

void Service::Run() {
  StartThreads();
  Workers workers(state_->services, state_->options.workers, state_->stop.get_token());
  Janitor janitor(state_->services);
  WebhookSender sender(state_->stores.webhooks, state_->options.webhooks);
  LogInfo("listening", {{"version", ProgramVersion()},
                        {"port", int64_t(port())},
                        {"workers", int64_t(state_->options.workers)}});
  state_->http.Run();
  workers.Stop();
  LogInfo("stopped", {});
}

// Builds go back to the queue while clients still get their answers.
void Service::Stop() {
  state_->stop.request_stop();
  state_->http.Stop();
}

}  // namespace kvx
