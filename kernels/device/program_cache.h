// Builds embedded OpenCL programs once per device and finds them again on disk.
#pragma once
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/device/opencl.h"

namespace kvx {

// Types and tuning constants, never volume sizes
using Defines = std::vector<std::pair<std::string, std::string>>;

// The text of kernels/cl/<file> with its #include "..." lines replaced by the files they name.
// Throws std::runtime_error for an unknown file (a bug: the files are embedded at build time).
std::string EmbeddedSource(std::string_view file);

bool IsPocls(const cl::Device& device);

// Thread-safe. A binary is keyed by the SHA-256 of source with includes, defines, device, driver and platform
// version; one that does not load is rebuilt, never reported.
class ProgramCache {
 public:
  ProgramCache(cl::Context context, cl::Device device, std::filesystem::path folder);

  // Throws Unavailable where the device cannot keep what it compiles, unless the program was asked for
  // before.
  cl::Program Build(std::string_view file, const Defines& defines = {});
  int compiled_count() const;  // programs compiled from source since construction (not found on disk)

 private:
  cl::Program LoadOrCompile(const std::string& source, const std::string& options, const std::string& key);
  bool TryLoad(const std::filesystem::path& path, const std::string& options, cl::Program& program) const;
  void Save(const cl::Program& program, const std::filesystem::path& path) const;

  cl::Context context_;
  cl::Device device_;
  std::filesystem::path folder_;
  mutable std::mutex mutex_;
  std::map<std::string, cl::Program> programs_;
  int compiled_ = 0;
};

}  // namespace kvx
