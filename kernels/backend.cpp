// Choosing and opening an OpenCL device.
#include "kernels/backend.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>

#include "core/errors.h"
#include "core/parallel.h"

namespace kvx {
namespace {

std::vector<cl::Device> AllDevices() {
  std::vector<cl::Platform> platforms;
  std::vector<cl::Device> devices;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error&) {
    return devices;  // no platform is installed
  }
  for (const cl::Platform& platform : platforms) {
    std::vector<cl::Device> here;
    try {
      platform.getDevices(CL_DEVICE_TYPE_ALL, &here);
    } catch (const cl::Error&) {
      continue;  // a platform without devices
    }
    devices.insert(devices.end(), here.begin(), here.end());
  }
  return devices;
}

std::string NameOf(const cl::Device& device) {
  std::string name = device.getInfo<CL_DEVICE_NAME>();
  name.erase(std::find(name.begin(), name.end(), '\0'), name.end());
  return name;
}

bool IsNumber(const std::string& text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c); });
}

// PoCL shows no device where it cannot keep what it compiles: under the home folder, which service accounts
// may not write. Code is loaded from there, so nobody else may have a hand in it.
void GiveKernelsAPlace() {
  if (std::getenv("POCL_CACHE_DIR") || std::getenv("XDG_CACHE_HOME")) return;
  const char* home = std::getenv("HOME");
  if (!home || ::access(home, W_OK) == 0 || ::access((std::string(home) + "/.cache").c_str(), W_OK) == 0)
    return;
  std::error_code error;
  const std::filesystem::path shared = std::filesystem::temp_directory_path(error);
  std::string place = (shared / ("kinevox-kernels-" + std::to_string(::getuid()))).string();
  struct stat found {};
  ::mkdir(place.c_str(), 0700);
  const bool own = ::lstat(place.c_str(), &found) == 0 && S_ISDIR(found.st_mode) &&
                   found.st_uid == ::getuid() && (found.st_mode & 077) == 0;
  if (!own) {
    place = (shared / "kinevox-kernels-XXXXXX").string();
    if (!::mkdtemp(place.data())) return;
  }
  ::setenv("POCL_CACHE_DIR", place.c_str(), 0);
}

cl::Device Choose(const BackendOptions& options) {
  GiveKernelsAPlace();
  // PoCL reads this once, when its platform is first opened.
  if (options.threads > 0) setenv("POCL_MAX_PTHREAD_COUNT", std::to_string(options.threads).c_str(), 0);
  const std::vector<cl::Device> devices = AllDevices();
  if (devices.empty())
    throw Unavailable(
        "no OpenCL device was found; install one (Debian: pocl-opencl-icd), or give PoCL a folder that it "
        "may write "
        "(POCL_CACHE_DIR)");
  if (IsNumber(options.device)) {
    size_t number = devices.size();  // stays so where the digits are too many
    std::from_chars(options.device.data(), options.device.data() + options.device.size(), number);
    if (number < devices.size()) return devices[number];
  } else if (!options.device.empty()) {
    for (const cl::Device& device : devices) {
      if (NameOf(device).find(options.device) != std::string::npos) return device;
    }
  } else {
    for (const cl::Device& device : devices) {
      if (device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_GPU) return device;
    }
    return devices[0];
  }
  std::string known;
  for (const std::string& name : DeviceNames()) known += "\n  " + name;
  throw Unavailable("no OpenCL device matches '" + options.device + "'; there are:" + known);
}

std::filesystem::path Or(const std::filesystem::path& path, const std::filesystem::path& fallback) {
  return path.empty() ? fallback : path;
}

}  // namespace

std::filesystem::path DefaultProgramFolder() {
  if (const char* folder = std::getenv("KVX_KERNEL_CACHE")) return folder;
  if (const char* cache = std::getenv("XDG_CACHE_HOME"))
    return std::filesystem::path(cache) / "kinevox/kernels";
  const char* home = std::getenv("HOME");
  return std::filesystem::path(home ? home : "/tmp") / ".cache/kinevox/kernels";
}

std::vector<std::string> DeviceNames() {
  std::vector<std::string> names;
  for (const cl::Device& device : AllDevices())
    names.push_back(std::to_string(names.size()) + ": " + NameOf(device));
  return names;
}

std::string DescribeFailure(const cl::Error& failure) {
  switch (failure.err()) {
    case CL_MEM_OBJECT_ALLOCATION_FAILURE:
    case CL_OUT_OF_RESOURCES:
    case CL_OUT_OF_HOST_MEMORY:
    case CL_INVALID_BUFFER_SIZE:
      return "the OpenCL device has too little free memory for this; end what else uses it, or choose "
             "another device, a CPU for instance (OpenCL error " +
             std::to_string(failure.err()) + ")";
    default:
      return "the OpenCL device failed (error " + std::to_string(failure.err()) + " of " + failure.what() +
             "); try again, or choose another device";
  }
}

Backend::Backend(const BackendOptions& options)
    : device_(Choose(options)),
      context_(device_),
      queue_(context_, device_),
      programs_(context_, device_, Or(options.cache, DefaultProgramFolder())),
      device_name_(NameOf(device_)),
      numerics_(device_name_ + " / " + device_.getInfo<CL_DRIVER_VERSION>()),
      is_cpu_(device_.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_CPU),
      thread_limit_(options.threads > 0 ? LimitThreads(options.threads) : nullptr) {}

}  // namespace kvx
