// One OpenCL device, its queue and its programs: what a stage computes with.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "kernels/device/program_cache.h"

namespace kvx {

struct BackendOptions {
  std::string
      device;       // part of the device's name, or its number; empty: the first GPU, else the first device
  int threads = 0;  // at most; 0: all. A CPU device takes those of the first backend of a process
  std::filesystem::path cache;  // folder of compiled programs; empty: the default (cache_folder.h)
  bool cpu_as_gpu = false;      // a CPU computes as GPUs do: on copies, and in groups of many work-items
};

std::vector<std::string> DeviceNames();  // numbered as BackendOptions::device takes them

// A sentence for users: what the device ran out of, or the code of its failure.
std::string DescribeFailure(const cl::Error& failure);

// Thread-safe. queue() is in order and shared: what a thread asks of it waits for what others asked before.
// Who must not wait for others takes NewQueue().
class Backend {
 public:
  explicit Backend(const BackendOptions& options = {});  // throws Unavailable when no device fits

  const std::string& device_name() const { return device_name_; }
  // What the numbers may depend on beside the inputs: part of every artefact's key.
  const std::string& numerics() const { return numerics_; }
  bool is_cpu() const { return is_cpu_; }  // and computes as one
  bool HasRoom() const;  // to keep what it compiles; without it programs that were not used yet are refused
  const cl::Context& context() const { return context_; }
  const cl::Device& device() const { return device_; }
  cl::CommandQueue& queue() { return queue_; }
  cl::CommandQueue NewQueue() const { return cl::CommandQueue(context_, device_); }
  ProgramCache& programs() { return programs_; }

 private:
  cl::Device device_;
  cl::Context context_;
  cl::CommandQueue queue_;
  ProgramCache programs_;
  std::string device_name_, numerics_;
  bool is_cpu_;
  std::shared_ptr<const void> thread_limit_;  // of loops on the host
};

}  // namespace kvx
