// One kind in the place of another.
#include "server/device_errors.h"

#include "core/errors.h"
#include "kernels/backend.h"

namespace kvx {

std::exception_ptr AsOurKind(std::exception_ptr error) try {
  std::rethrow_exception(error);
} catch (const cl::Error& failure) {
  return std::make_exception_ptr(Unavailable(DescribeFailure(failure)));
} catch (...) {
  return error;
}

}  // namespace kvx
