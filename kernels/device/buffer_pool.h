// Device memory that is kept from one use to the next: it grows, and counts how often it did.
#pragma once
#include <atomic>

#include "kernels/device/device_buffer.h"

namespace kvx {

// What the buffers of one owner have asked of the device so far. In a steady state it stands still.
struct BufferCounts {
  std::atomic<int64_t> allocations = 0, bytes = 0;
};

template <class T>
class PooledBuffer {
 public:
  PooledBuffer(const Backend& backend, BufferCounts& counts)
      : context_(backend.context()),
        counts_(&counts),
        most_(size_t(backend.device().getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>() / sizeof(T))) {}

  // At least `count` values; what was in them may be lost.
  // Memory the host can look at without a copy where it shares it.
  void Require(size_t count) {
    if (count <= capacity_) return;
    const size_t grown = std::max(count, std::min(most_, capacity_ + capacity_ / 2));
    GiveBackBeyond(0);  // the device need not hold both
    buffer_ = cl::Buffer(context_, CL_MEM_READ_WRITE | CL_MEM_ALLOC_HOST_PTR, grown * sizeof(T));
    ++counts_->allocations;
    counts_->bytes += int64_t(grown * sizeof(T));
    capacity_ = grown;
  }
  // What was unusually large is not kept.
  void GiveBackBeyond(size_t count) {
    if (capacity_ <= count) return;
    buffer_ = cl::Buffer();
    counts_->bytes -= int64_t(capacity_ * sizeof(T));
    capacity_ = 0;
  }
  const cl::Buffer& buffer() const { return buffer_; }
  size_t capacity() const { return capacity_; }

  void Upload(cl::CommandQueue& queue, std::span<const T> values) {
    Require(std::max<size_t>(1, values.size()));
    if (!values.empty()) queue.enqueueWriteBuffer(buffer_, CL_TRUE, 0, values.size_bytes(), values.data());
  }
  // Calls use(span) on the first `count` values as the device left them, once it has finished.
  template <class Use>
  void Read(cl::CommandQueue& queue, size_t count, Use use) const {
    if (count == 0) return;
    MappedMemory mapped(queue, buffer_, CL_MAP_READ, count * sizeof(T));
    use(std::span<const T>(static_cast<const T*>(mapped.data()), count));
    mapped.Unmap();
  }

 private:
  cl::Context context_;
  BufferCounts* counts_;
  size_t most_;  // values that the device takes in one buffer
  cl::Buffer buffer_;
  size_t capacity_ = 0;
};

}  // namespace kvx
