// What the host and a device share, given back in order whatever is thrown meanwhile.
#pragma once
#include <utility>

#include "kernels/device/opencl.h"

namespace kvx {

// Memory of a buffer that the host looks at until the end of the scope.
class MappedMemory {
 public:
  // Waits until the device has finished with the buffer. Throws cl::Error.
  MappedMemory(const cl::CommandQueue& queue, const cl::Buffer& buffer, cl_map_flags how, size_t bytes)
      : queue_(queue), buffer_(buffer), at_(queue.enqueueMapBuffer(buffer, CL_TRUE, how, 0, bytes)) {}
  ~MappedMemory() {
    if (at_ && clEnqueueUnmapMemObject(queue_(), buffer_(), at_, 0, nullptr, nullptr) == CL_SUCCESS)
      clFinish(queue_());
  }
  MappedMemory(const MappedMemory&) = delete;
  MappedMemory& operator=(const MappedMemory&) = delete;

  void* data() const { return at_; }
  // Ends the mapping before the scope does; throws cl::Error where what was written did not arrive.
  void Unmap() {
    cl::Event done;
    queue_.enqueueUnmapMemObject(buffer_, std::exchange(at_, nullptr), nullptr, &done);
    done.wait();
  }

 private:
  cl::CommandQueue queue_;
  cl::Buffer buffer_;
  void* at_;
};

// Memory that was lent to the device must outlive the kernels that use it: at the end of its scope this waits
// for all that a queue was given. Declared after the memory, before what may throw.
class FinishedQueue {
 public:
  explicit FinishedQueue(const cl::CommandQueue& queue) : queue_(queue) {}
  ~FinishedQueue() { clFinish(queue_()); }
  FinishedQueue(const FinishedQueue&) = delete;
  FinishedQueue& operator=(const FinishedQueue&) = delete;

 private:
  cl::CommandQueue queue_;
};

}  // namespace kvx
