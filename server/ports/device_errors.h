// Failures of the OpenCL device, and of a machine that has no more to give, as one of our kinds
// (core/errors.h).
#pragma once
#include <exception>

namespace kvx {

// Unavailable in place of the device's own error and of one that a file or folder gives, and where memory or
// threads are lacking, as it may work later; others stay as they are.
std::exception_ptr AsOurKind(std::exception_ptr error);

}  // namespace kvx
