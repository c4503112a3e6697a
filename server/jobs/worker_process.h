// `kinevox worker`: the service's workers without its HTTP side, as another process on the same data folder.
// What kills it, a driver for one, costs a job an attempt and nobody else anything.
#pragma once
#include <filesystem>
#include <memory>

#include "kernels/device/backend.h"

namespace kvx {

struct WorkerProcessOptions {
  std::filesystem::path data;
  int workers = 1;
  int64_t lease_ms = 15'000;
  // That running jobs may declare together, over all processes; 0: most of the machine's
  int64_t memory_bytes = 0;
  uintmax_t least_free_bytes = uintmax_t(512) << 20;  // of the disk; below no job is begun
  BackendOptions backend;
};

class WorkerProcess {
 public:
  explicit WorkerProcess(const WorkerProcessOptions& options);
  ~WorkerProcess();
  void Run();   // until Stop; running jobs are given back before it returns
  void Stop();  // from any thread

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// What jobs may declare together when nobody says: most of the memory that this machine or container has.
int64_t UsualMemoryBytes();

}  // namespace kvx
