// Choosing and opening an OpenCL device.
#include "kernels/device/backend.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>

#include "core/errors.h"
#include "core/host/parallel.h"
#include "kernels/device/cache_folder.h"

namespace kvx {
namespace {

std::vector<cl::Device> AllDevices() {
  GivePoclAFolder();
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

// "OpenCL 1.2 ..."
bool IsNewEnough(const std::string& version) {
  int major = 0, minor = 0;
  return std::sscanf(version.c_str(), "OpenCL %d.%d", &major, &minor) == 2 &&
         (major > 1 || (major == 1 && minor >= 2));
}

bool CanCompute(const cl::Device& device) {
  return device.getInfo<CL_DEVICE_AVAILABLE>() && device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>() &&
         IsNewEnough(device.getInfo<CL_DEVICE_VERSION>());
}

// A GPU before others, and what can compute before what cannot.
cl::Device UsualOf(const std::vector<cl::Device>& devices) {
  const auto rank = [](const cl::Device& device) {
    const bool gpu = device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_GPU;
    return 2 * int(CanCompute(device)) + int(gpu);
  };
  return *std::ranges::max_element(devices, {}, rank);  // the first of equals
}

bool IsNumber(const std::string& text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c); });
}

cl::Device Choose(const BackendOptions& options) {
  // PoCL reads this once, when its platform is first opened.
  if (options.threads > 0) setenv("POCL_MAX_PTHREAD_COUNT", std::to_string(options.threads).c_str(), 0);
  const std::vector<cl::Device> devices = AllDevices();
  if (devices.empty())
    throw Unavailable(
        "no OpenCL device was found; install one (Debian: pocl-opencl-icd), or give PoCL a folder that only "
        "you may write to (POCL_CACHE_DIR)");
  if (IsNumber(options.device)) {
    size_t number = devices.size();  // stays so where the digits are too many
    std::from_chars(options.device.data(), options.device.data() + options.device.size(), number);
    if (number < devices.size()) return devices[number];
  } else if (!options.device.empty()) {
    for (const cl::Device& device : devices) {
      if (NameOf(device).find(options.device) != std::string::npos) return device;
    }
  } else {
    return UsualOf(devices);
  }
  std::string known;
  for (const std::string& name : DeviceNames()) known += "\n  " + name;
  throw Unavailable("no OpenCL device matches '" + options.device + "'; there are:" + known);
}

cl::Device Usable(const cl::Device& device) {
  if (IsPocls(device)) RequirePoclsFolder();
  return device;
}

// PoCL's compiler is named by its platform alone.
std::string NumericsOf(const cl::Device& device) {
  const cl::Platform platform(device.getInfo<CL_DEVICE_PLATFORM>());
  return NameOf(device) + " / " + device.getInfo<CL_DRIVER_VERSION>() + " / " +
         platform.getInfo<CL_PLATFORM_VERSION>();
}

std::filesystem::path Or(const std::filesystem::path& path, const std::filesystem::path& fallback) {
  return path.empty() ? fallback : path;
}

}  // namespace

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

bool Backend::HasRoom() const { return !IsPocls(device_) || PoclsFolderHasRoom(); }

Backend::Backend(const BackendOptions& options)
    : device_(Usable(Choose(options))),
      context_(device_),
      queue_(context_, device_),
      programs_(context_, device_, Or(options.cache, DefaultProgramFolder())),
      device_name_(NameOf(device_)),
      numerics_(NumericsOf(device_) + (options.cpu_as_gpu ? " / as a GPU" : "")),
      is_cpu_((device_.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_CPU) && !options.cpu_as_gpu),
      thread_limit_(options.threads > 0 ? LimitThreads(options.threads) : nullptr) {}

}  // namespace kvx
