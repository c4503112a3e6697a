// Failures of the OpenCL device as one of our kinds (core/errors.h).
#pragma once
#include <exception>

namespace kvx {

// Unavailable in place of the device's own error, as it may have more memory later; others stay as they are.
std::exception_ptr AsOurKind(std::exception_ptr error);

}  // namespace kvx
