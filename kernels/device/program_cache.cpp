// Two levels of program cache: in memory by key, on disk as the driver's binary.
#include "kernels/device/program_cache.h"

#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "core/digest.h"
#include "kernels/device/cache_folder.h"

namespace kvx {

std::string_view EmbeddedKernels(std::string_view name);

namespace {

// A binary is code: whoever wrote it acts as this user. Nobody but its owner can replace it in a folder that
// is theirs (cache_folder.h).
bool OfTrustedOwner(const std::filesystem::path& file) {
  struct stat found {};
  return ::stat(file.c_str(), &found) == 0 && (found.st_uid == ::getuid() || found.st_uid == 0) &&
         (found.st_mode & 022) == 0;
}

}  // namespace

std::string EmbeddedSource(std::string_view file) {
  const std::string_view text = EmbeddedKernels(file);
  if (text.empty()) throw std::runtime_error("no embedded kernel file " + std::string(file));
  constexpr std::string_view kInclude = "#include \"";
  std::string out;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size() - 1) + 1;
    const std::string_view line = text.substr(at, end - at);
    if (line.starts_with(kInclude)) {
      out += EmbeddedSource(line.substr(kInclude.size(), line.find('"', kInclude.size()) - kInclude.size()));
    } else {
      out += line;
    }
    at = end;
  }
  return out;
}

bool IsPocls(const cl::Device& device) {
  const cl::Platform platform(device.getInfo<CL_DEVICE_PLATFORM>());
  return platform.getInfo<CL_PLATFORM_NAME>().starts_with("Portable Computing Language");
}

ProgramCache::ProgramCache(cl::Context context, cl::Device device, std::filesystem::path folder)
    : context_(std::move(context)), device_(std::move(device)), folder_(std::move(folder)) {}

int ProgramCache::compiled_count() const {
  const std::scoped_lock lock(mutex_);
  return compiled_;
}

cl::Program ProgramCache::Build(std::string_view file, const Defines& defines) {
  std::string options = "-cl-std=CL1.2";
  for (const auto& [name, value] : defines) options += " -D" + name + "=" + value;
  const std::string source = EmbeddedSource(file);
  const cl::Platform platform(device_.getInfo<CL_DEVICE_PLATFORM>());
  const std::string key = Hasher()
                              .Add(source)
                              .Add(options)
                              .Add(device_.getInfo<CL_DEVICE_NAME>())
                              .Add(device_.getInfo<CL_DEVICE_VERSION>())
                              .Add(device_.getInfo<CL_DRIVER_VERSION>())
                              .Add(platform.getInfo<CL_PLATFORM_VERSION>())
                              .Finish()
                              .Hex();
  const std::scoped_lock lock(mutex_);
  if (const auto found = programs_.find(key); found != programs_.end()) return found->second;
  if (IsPocls(device_)) RequirePoclsRoom();  // its kernels are compiled at their first use, soon
  return programs_[key] = LoadOrCompile(source, options, key);
}

cl::Program ProgramCache::LoadOrCompile(const std::string& source, const std::string& options,
                                        const std::string& key) {
  const std::filesystem::path path = folder_ / (key + ".clbin");
  cl::Program program;
  if (TryLoad(path, options, program)) return program;
  program = cl::Program(context_, source);
  try {
    program.build(device_, options.c_str());
  } catch (const cl::Error& failure) {
    if (failure.err() != CL_BUILD_PROGRAM_FAILURE) throw;  // no memory, for instance
    throw std::runtime_error("an OpenCL program does not compile:\n" +
                             program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device_));
  }
  ++compiled_;
  Save(program, path);
  return program;
}

bool ProgramCache::TryLoad(const std::filesystem::path& path, const std::string& options,
                           cl::Program& program) const {
  if (!OfTrustedOwner(path)) return false;
  std::ifstream file(path, std::ios::binary);
  if (!file) return false;
  const std::vector<unsigned char> bytes((std::istreambuf_iterator<char>(file)), {});
  try {
    program = cl::Program(context_, {device_}, {bytes});
    program.build(device_, options.c_str());
    return true;
  } catch (const cl::Error&) {
    return false;
  }
}

// A cache that cannot be written costs time, not correctness, so failures here are silent.
void ProgramCache::Save(const cl::Program& program, const std::filesystem::path& path) const {
  const auto binaries = program.getInfo<CL_PROGRAM_BINARIES>();
  if (folder_.empty() || binaries.empty() || binaries[0].empty()) return;
  std::error_code ignored;
  std::filesystem::create_directories(folder_, ignored);
  static std::atomic<int> serial = 0;
  const std::filesystem::path temporary =
      path.string() + "." + std::to_string(getpid()) + "." + std::to_string(serial++);
  {
    std::ofstream file(temporary, std::ios::binary);
    file.write(reinterpret_cast<const char*>(binaries[0].data()), std::streamsize(binaries[0].size()));
    if (!file.flush()) {
      std::filesystem::remove(temporary, ignored);
      return;
    }
  }
  using std::filesystem::perms;
  std::filesystem::permissions(
      temporary, perms::owner_read | perms::owner_write | perms::group_read | perms::others_read, ignored);
  std::error_code failed;
  std::filesystem::rename(temporary, path, failed);
  if (failed) std::filesystem::remove(temporary, ignored);
}

}  // namespace kvx
