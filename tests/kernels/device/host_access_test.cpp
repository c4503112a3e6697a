// Memory that host and device share, when something throws.
#include "kernels/device/host_access.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "kernels/device/buffer_pool.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

TEST(PooledBuffer, ReadsAgainAfterAReaderThatThrew) {
  cl::CommandQueue& queue = SharedBackend().queue();
  std::vector<int32_t> numbers(1000);
  std::iota(numbers.begin(), numbers.end(), 0);
  BufferCounts counts;
  PooledBuffer<int32_t> buffer(SharedBackend(), counts);
  buffer.Upload(queue, numbers);
  const auto throws = [](std::span<const int32_t>) { throw std::runtime_error("not today"); };
  EXPECT_THROW(buffer.Read(queue, numbers.size(), throws), std::runtime_error);
  EXPECT_EQ(buffer.buffer().getInfo<CL_MEM_MAP_COUNT>(), 0u);
  buffer.Read(queue, numbers.size(), [&](std::span<const int32_t> found) {
    EXPECT_TRUE(std::equal(found.begin(), found.end(), numbers.begin(), numbers.end()));
  });
}

// It asks for more than it needs, but not for more than the device gives at once.
TEST(PooledBuffer, GrowsToWhatTheDeviceGivesAtMost) {
  const Backend& backend = SharedBackend();
  const auto most = size_t(backend.device().getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>());
  const size_t first = most / 100 * 70, second = most / 100 * 75;
  BufferCounts counts;
  try {
    PooledBuffer<char>(backend, counts).Require(second);
  } catch (const cl::Error&) {
    GTEST_SKIP() << "this machine has less memory than its device promises";
  }
  PooledBuffer<char> buffer(backend, counts);
  buffer.Require(first);
  EXPECT_NO_THROW(buffer.Require(second));
  EXPECT_GE(buffer.capacity(), second);
  EXPECT_LE(buffer.capacity(), most);
}

// Of many values, which the host writes for a CPU, and of few, which the device does.
TEST(DeviceBuffer, IsFilledAndCopiedToItsLastValue) {
  Backend& backend = SharedBackend();
  for (const size_t count : {size_t(3) << 20, size_t(1001)}) {
    DeviceBuffer<float> filled(backend, count), copied(backend, count);
    filled.Fill(backend.queue(), 2.5f);
    copied.Copy(backend.queue(), filled);
    filled.Fill(backend.queue(), -1.0f);
    EXPECT_EQ(copied.Download(backend.queue()), std::vector<float>(count, 2.5f)) << count;
    EXPECT_EQ(filled.Download(backend.queue()), std::vector<float>(count, -1.0f)) << count;
    copied.UploadFrom(backend.queue(), [](std::span<float> values) { values[7] = 4; });
    copied.DownloadTo(backend.queue(), [&](std::span<const float> values) {
      EXPECT_EQ(values[7], 4) << count;
      EXPECT_EQ(std::ranges::count(values, 0.0f), int64_t(count) - 1) << "all others are zero";
    });
  }
}

// The values go when the exception has passed: by then nothing may read them any more.
TEST(DeviceBuffer, WhatWasLentIsReturnedBeforeAnExceptionLeavesItsScope) {
  Backend& backend = SharedBackend();
  if (!backend.is_cpu()) GTEST_SKIP() << "this device works on copies";
  const size_t count = size_t(16) << 20;
  const DeviceBuffer<float> out(backend, count);
  cl::Event copied;
  try {
    const std::vector<float> values(count, 3.0f);
    const auto lent = DeviceBuffer<float>::Shared(backend, values);
    backend.queue().enqueueCopyBuffer(lent.buffer(), out.buffer(), 0, 0, count * sizeof(float), nullptr,
                                      &copied);
    throw std::runtime_error("not today");
  } catch (const std::runtime_error&) {
    EXPECT_EQ(copied.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>(), CL_COMPLETE);
  }
  const std::vector<float> found = out.Download(backend.queue());
  EXPECT_EQ(std::count(found.begin(), found.end(), 3.0f), std::ptrdiff_t(count));
}

}  // namespace
}  // namespace kvx
