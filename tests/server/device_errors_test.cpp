// What the service makes of failures of the OpenCL device.
#include "server/device_errors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "core/errors.h"
#include "kernels/opencl.h"

namespace kvx {
namespace {

TEST(DeviceErrors, ADeviceWithoutMemoryIsUnavailableAndSaysWhatToDo) {
  const auto known =
      AsOurKind(std::make_exception_ptr(cl::Error(CL_MEM_OBJECT_ALLOCATION_FAILURE, "clEnqueueWriteBuffer")));
  EXPECT_THAT([&] { std::rethrow_exception(known); },
              testing::ThrowsMessage<Unavailable>(testing::HasSubstr("choose another device")));
}

TEST(DeviceErrors, OtherErrorsStayAsTheyAre) {
  const auto error = std::make_exception_ptr(InputError("wrong"));
  EXPECT_EQ(AsOurKind(error), error);
}

}  // namespace
}  // namespace kvx
