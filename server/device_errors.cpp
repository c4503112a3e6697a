// One kind in the place of another.
#include "server/device_errors.h"

#include <filesystem>
#include <new>
#include <system_error>

#include "core/errors.h"
#include "kernels/backend.h"

namespace kvx {
namespace {

std::exception_ptr TooLittle() {
  return std::make_exception_ptr(
      Unavailable("the service's machine has no memory or no threads left for this; try again later, or ask "
                  "for less at once"));
}

}  // namespace

std::exception_ptr AsOurKind(std::exception_ptr error) try {
  std::rethrow_exception(error);
} catch (const cl::Error& failure) {
  return std::make_exception_ptr(Unavailable(DescribeFailure(failure)));
} catch (const std::bad_alloc&) {
  return TooLittle();
} catch (const std::filesystem::filesystem_error&) {  // ToProblem knows it
  return error;
} catch (const std::system_error&) {  // of a thread
  return TooLittle();
} catch (...) {
  return error;
}

}  // namespace kvx
