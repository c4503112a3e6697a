// Where volumes and pictures go that come one after the other.
#pragma once

namespace kvx {

// Takes frames in order. What is written appears under its name only with Finish.
template <class Frame>
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual void Add(const Frame& frame) = 0;
  virtual void Finish() = 0;
};

}  // namespace kvx
