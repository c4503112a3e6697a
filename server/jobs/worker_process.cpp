// No HTTP, janitor or webhooks: those belong to the one service.
#include "server/jobs/worker_process.h"

#include <unistd.h>

#include <condition_variable>
#include <fstream>
#include <mutex>

#include "core/host/parallel.h"
#include "core/version.h"
#include "server/jobs/workers.h"
#include "server/log.h"
#include "server/ports/pipeline_ports.h"

namespace kvx {
namespace {

constexpr double kMostOfMemory = 0.8;

}  // namespace

int64_t UsualMemoryBytes() {
  int64_t bytes = int64_t(::sysconf(_SC_PHYS_PAGES)) * ::sysconf(_SC_PAGESIZE);
  int64_t limit = 0;
  if (std::ifstream("/sys/fs/cgroup/memory.max") >> limit && limit > 0)
    bytes = std::min(bytes, limit);  // "max" is no number
  return int64_t(double(bytes) * kMostOfMemory);
}

struct WorkerProcess::State {
  explicit State(const WorkerProcessOptions& o)
      : options(o),
        stores(o.data, {.use = DataFolder::Use::kWorker,
                        .lease_ms = o.lease_ms,
                        .memory_bytes = o.memory_bytes > 0 ? o.memory_bytes : UsualMemoryBytes(),
                        .least_free_bytes = o.least_free_bytes}),
        builder(stores.data, o.backend),
        poser(stores.data, o.backend),
        services(ServicesOver(stores, inspector, builder, poser)) {}

  WorkerProcessOptions options;
  Stores stores;
  PipelineInspector inspector;
  PipelineBuilder builder;
  PipelinePoser poser;
  Services services;

  std::mutex mutex;
  std::condition_variable asked;
  bool stop = false;
};

WorkerProcess::WorkerProcess(const WorkerProcessOptions& options)
    : state_(std::make_unique<State>(options)) {}
WorkerProcess::~WorkerProcess() = default;

void WorkerProcess::Run() {
  StartThreads();
  Workers workers(state_->services, state_->options.workers);
  LogInfo("working", {{"version", ProgramVersion()}, {"workers", int64_t(state_->options.workers)}});
  {
    std::unique_lock lock(state_->mutex);
    state_->asked.wait(lock, [this] { return state_->stop; });
  }
  workers.Stop();
  LogInfo("stopped", {});
}

void WorkerProcess::Stop() {
  const std::lock_guard lock(state_->mutex);
  state_->stop = true;
  state_->asked.notify_all();
}

}  // namespace kvx
