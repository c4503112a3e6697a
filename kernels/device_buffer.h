// A typed buffer on the device. Copies block, so host memory may be freed at once, but for Shared.
#pragma once
#include <span>
#include <vector>

#include "kernels/backend.h"

namespace kvx {

template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  DeviceBuffer(const Backend& backend, size_t count) : count_(count) {
    buffer_ = cl::Buffer(backend.context(), CL_MEM_READ_WRITE, std::max<size_t>(1, count) * sizeof(T));
  }
  DeviceBuffer(Backend& backend, std::span<const T> values) : DeviceBuffer(backend, values.size()) {
    Upload(backend.queue(), values);
  }

  // Only read by kernels. A CPU device works on the values themselves: they must outlive the buffer and stay
  // as they are.
  static DeviceBuffer Shared(Backend& backend, std::span<const T> values) {
    if (!backend.is_cpu() || values.empty()) return DeviceBuffer(backend, values);
    DeviceBuffer out;
    out.buffer_ = cl::Buffer(backend.context(), CL_MEM_READ_ONLY | CL_MEM_USE_HOST_PTR, values.size_bytes(),
                             const_cast<T*>(values.data()));
    out.count_ = values.size();
    return out;
  }

  size_t size() const { return count_; }
  const cl::Buffer& buffer() const { return buffer_; }

  void Upload(cl::CommandQueue& queue, std::span<const T> values) {
    if (!values.empty()) queue.enqueueWriteBuffer(buffer_, CL_TRUE, 0, values.size_bytes(), values.data());
  }
  void Download(cl::CommandQueue& queue, std::span<T> values) const {
    if (!values.empty()) queue.enqueueReadBuffer(buffer_, CL_TRUE, 0, values.size_bytes(), values.data());
  }
  std::vector<T> Download(cl::CommandQueue& queue) const {
    std::vector<T> values(count_);
    Download(queue, values);
    return values;
  }
  void Fill(cl::CommandQueue& queue, T value) {
    if (count_) queue.enqueueFillBuffer(buffer_, value, 0, count_ * sizeof(T));
  }

 private:
  cl::Buffer buffer_;
  size_t count_ = 0;
};

}  // namespace kvx
