// What the service makes of failures of the OpenCL device and of want.
#include "server/ports/device_errors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <ios>
#include <new>
#include <stdexcept>
#include <system_error>

#include "core/errors.h"
#include "kernels/device/opencl.h"

namespace kvx {
namespace {

TEST(DeviceErrors, ADeviceWithoutMemoryIsUnavailableAndSaysWhatToDo) {
  const auto known =
      AsOurKind(std::make_exception_ptr(cl::Error(CL_MEM_OBJECT_ALLOCATION_FAILURE, "clEnqueueWriteBuffer")));
  EXPECT_THAT([&] { std::rethrow_exception(known); },
              testing::ThrowsMessage<Unavailable>(testing::HasSubstr("choose another device")));
}

TEST(DeviceErrors, WantOfMemoryOrThreadsIsUnavailable) {
  const auto no_thread = std::make_error_code(std::errc::resource_unavailable_try_again);
  for (const std::exception_ptr& want :
       {std::make_exception_ptr(std::bad_alloc()), std::make_exception_ptr(std::system_error(no_thread))})
    EXPECT_THROW(std::rethrow_exception(AsOurKind(want)), Unavailable);
}

TEST(DeviceErrors, AFileThatCannotBeReadOrWrittenIsUnavailableAndItsPathIsNotSaid) {
  const auto error = std::make_error_code(std::errc::io_error);
  const auto known =
      AsOurKind(std::make_exception_ptr(std::filesystem::filesystem_error("write", "/scans/Mueller", error)));
  EXPECT_THAT([&] { std::rethrow_exception(known); },
              testing::ThrowsMessage<Unavailable>(
                  testing::AllOf(testing::HasSubstr(error.message()), Not(testing::HasSubstr("Mueller")))));
  const auto stream = AsOurKind(std::make_exception_ptr(std::ios_base::failure("read")));
  EXPECT_THAT([&] { std::rethrow_exception(stream); },
              testing::ThrowsMessage<Unavailable>(testing::HasSubstr("cannot be read")));
}

TEST(DeviceErrors, OtherErrorsStayAsTheyAre) {
  const auto error = std::make_exception_ptr(InputError("wrong"));
  EXPECT_EQ(AsOurKind(error), error);
}

}  // namespace
}  // namespace kvx
