// A typed buffer on the device. Copies block, so host memory may be freed at once, but for Shared.
#pragma once
#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "core/host/parallel.h"
#include "kernels/device/backend.h"
#include "kernels/device/host_access.h"

namespace kvx {

template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  DeviceBuffer(const Backend& backend, size_t count) : count_(count), on_host_(backend.is_cpu()) {
    buffer_ = cl::Buffer(backend.context(), CL_MEM_READ_WRITE, std::max<size_t>(1, count) * sizeof(T));
  }
  DeviceBuffer(Backend& backend, std::span<const T> values) : DeviceBuffer(backend, values.size()) {
    Upload(backend.queue(), values);
  }

  // Only read by kernels of the backend's queue. A CPU device works on the values themselves: they must
  // outlive the buffer and stay as they are. The buffer's end waits for what is still queued.
  static DeviceBuffer Shared(Backend& backend, std::span<const T> values) {
    if (!backend.is_cpu() || values.empty()) return DeviceBuffer(backend, values);
    DeviceBuffer out;
    out.buffer_ = cl::Buffer(backend.context(), CL_MEM_READ_ONLY | CL_MEM_USE_HOST_PTR, values.size_bytes(),
                             const_cast<T*>(values.data()));
    out.count_ = values.size();
    out.lent_ = std::make_shared<const FinishedQueue>(backend.queue());
    return out;
  }

  size_t size() const { return count_; }
  const cl::Buffer& buffer() const { return buffer_; }

  void Upload(cl::CommandQueue& queue, std::span<const T> values) {
    const size_t bytes = values.size_bytes();
    if (on_host_ && bytes >= kMappedBytes) {
      WithMapped(queue, CL_MAP_WRITE, bytes,
                 [&](void* mapped) { ParallelCopy(mapped, values.data(), bytes); });
    } else if (bytes > 0) {
      queue.enqueueWriteBuffer(buffer_, CL_TRUE, 0, bytes, values.data());
    }
  }
  void Download(cl::CommandQueue& queue, std::span<T> values) const {
    const size_t bytes = values.size_bytes();
    if (on_host_ && bytes >= kMappedBytes) {
      WithMapped(queue, CL_MAP_READ, bytes,
                 [&](void* mapped) { ParallelCopy(values.data(), mapped, bytes); });
    } else if (bytes > 0) {
      queue.enqueueReadBuffer(buffer_, CL_TRUE, 0, bytes, values.data());
    }
  }
  std::vector<T> Download(cl::CommandQueue& queue) const {
    std::vector<T> values(count_);
    Download(queue, values);
    return values;
  }
  // As Upload and Download, of what put(values) makes of zeros, and for look(values): a CPU's values are
  // where they lie.
  template <class Put>
  void UploadFrom(cl::CommandQueue& queue, const Put& put) {
    if (on_host_ && count_ * sizeof(T) >= kMappedBytes) {
      WithMapped(queue, CL_MAP_WRITE, count_ * sizeof(T), [&](void* mapped) {
        const std::span values(static_cast<T*>(mapped), count_);
        FillAll(values, T{});
        put(values);
      });
    } else {
      std::vector<T> values(count_);
      put(std::span(values));
      Upload(queue, values);
    }
  }
  template <class Look>
  void DownloadTo(cl::CommandQueue& queue, const Look& look) const {
    if (on_host_ && count_ * sizeof(T) >= kMappedBytes) {
      WithMapped(queue, CL_MAP_READ, count_ * sizeof(T),
                 [&](const void* mapped) { look(std::span(static_cast<const T*>(mapped), count_)); });
    } else {
      const std::vector<T> values = Download(queue);
      look(std::span(values));
    }
  }
  void Fill(cl::CommandQueue& queue, T value) {
    const size_t bytes = count_ * sizeof(T);
    if (on_host_ && bytes >= kMappedBytes) {
      WithMapped(queue, CL_MAP_WRITE, bytes,
                 [&](void* mapped) { FillAll(std::span(static_cast<T*>(mapped), count_), value); });
    } else if (bytes > 0) {
      queue.enqueueFillBuffer(buffer_, value, 0, bytes);
    }
  }
  // What the other, of the same size, holds.
  void Copy(cl::CommandQueue& queue, const DeviceBuffer& from) {
    const size_t bytes = count_ * sizeof(T);
    if (on_host_ && bytes >= kMappedBytes) {
      from.WithMapped(queue, CL_MAP_READ, bytes, [&](const void* values) {
        WithMapped(queue, CL_MAP_WRITE, bytes, [&](void* mapped) { ParallelCopy(mapped, values, bytes); });
      });
    } else if (bytes > 0) {
      queue.enqueueCopyBuffer(from.buffer_, buffer_, 0, 0, bytes);
    }
  }

 private:
  static void FillAll(std::span<T> values, T value) {
    ParallelRanges(values.size(), [&](size_t begin, size_t end) {
      std::fill(values.begin() + std::ptrdiff_t(begin), values.begin() + std::ptrdiff_t(end), value);
    });
  }
  // A CPU device's own copies keep one thread busy and the others waiting.
  static constexpr size_t kMappedBytes = 4 << 20;
  template <class Use>
  void WithMapped(cl::CommandQueue& queue, cl_map_flags how, size_t bytes, Use use) const {
    MappedMemory mapped(queue, buffer_, how, bytes);
    use(mapped.data());
    mapped.Unmap();
  }

  cl::Buffer buffer_;
  size_t count_ = 0;
  bool on_host_ = false;
  std::shared_ptr<const FinishedQueue> lent_;
};

}  // namespace kvx
