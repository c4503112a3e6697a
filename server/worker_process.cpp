// The same parts as server/service.cpp, less HTTP, janitor and webhooks: those belong to the one service.
#include "server/worker_process.h"

#include <unistd.h>

#include <condition_variable>
#include <fstream>
#include <mutex>

#include "server/log.h"
#include "server/pipeline_ports.h"
#include "server/workers.h"
#include "storage/data_folder.h"
#include "storage/ids.h"

namespace kvx {
namespace {

constexpr double kMostOfMemory = 0.8;
constexpr int64_t kScratchResultBytes = int64_t(1) << 30;

}  // namespace

int64_t UsualMemoryBytes() {
  int64_t bytes = int64_t(::sysconf(_SC_PHYS_PAGES)) * ::sysconf(_SC_PAGESIZE);
  int64_t limit = 0;
  if (std::ifstream("/sys/fs/cgroup/memory.max") >> limit && limit > 0) bytes = std::min(bytes, limit);  // "max" is no number
  return int64_t(double(bytes) * kMostOfMemory);
}

struct WorkerProcess::State {
  explicit State(const WorkerProcessOptions& o)
      : options(o),
        data(o.data, DataFolder::Use::kWorker),
        database(data.database()),
        jobs(database, o.lease_ms),
        blobs(data.root(), false),
        results(data.work() / NewId("res"), kScratchResultBytes),
        resumable(database, data.uploads()),
        builder(data, o.backend),
        poser(data, o.backend),
        services{catalogue, jobs, idempotency, blobs, results, audit, keys, retention, inspector,
                 builder, poser, resumable, webhooks} {
    jobs.set_memory_budget(o.memory_bytes > 0 ? o.memory_bytes : UsualMemoryBytes());
  }

  WorkerProcessOptions options;
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
  PipelineInspector inspector;
  PipelineBuilder builder;
  PipelinePoser poser;
  Services services;

  std::mutex mutex;
  std::condition_variable asked;
  bool stop = false;
};

WorkerProcess::WorkerProcess(const WorkerProcessOptions& options) : state_(std::make_unique<State>(options)) {}
WorkerProcess::~WorkerProcess() = default;

void WorkerProcess::Run() {
  Workers workers(state_->services, state_->metrics, state_->options.workers);
  LogInfo("working", {{"workers", int64_t(state_->options.workers)}});
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
