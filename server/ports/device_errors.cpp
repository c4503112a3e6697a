// One kind in the place of another.
#include "server/ports/device_errors.h"

#include <filesystem>
#include <ios>
#include <new>
#include <string>
#include <system_error>

#include "core/errors.h"
#include "kernels/device/backend.h"

namespace kvx {
namespace {

std::exception_ptr TooLittle() {
  return std::make_exception_ptr(
      Unavailable("the service's machine has no memory or no threads left for this; try again later, or ask "
                  "for less at once"));
}

std::exception_ptr Unreadable(const std::string& why) {
  return std::make_exception_ptr(Unavailable(
      "a file or folder of the service's disk cannot be read or written (" + why + "); try again later"));
}

}  // namespace

std::exception_ptr AsOurKind(std::exception_ptr error) try {
  std::rethrow_exception(error);
} catch (const cl::Error& failure) {
  return std::make_exception_ptr(Unavailable(DescribeFailure(failure)));
} catch (const std::bad_alloc&) {
  return TooLittle();
} catch (const std::filesystem::filesystem_error& failure) {  // its own words name paths
  return Unreadable(failure.code().message());
} catch (const std::ios_base::failure&) {
  return Unreadable("it ends too early");
} catch (const std::system_error&) {  // of a thread
  return TooLittle();
} catch (...) {
  return error;
}

}  // namespace kvx
