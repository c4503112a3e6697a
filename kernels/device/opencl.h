// The OpenCL C++ bindings, included one way everywhere (version and
// exceptions are set in cmake/KvxDependencies.cmake).
#pragma once
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wignored-attributes"
#pragma GCC diagnostic ignored "-Wpedantic"
#include <CL/opencl.hpp>
#pragma GCC diagnostic pop
