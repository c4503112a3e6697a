// Progress of long work, and the request to stop it.
#pragma once
#include <functional>
#include <string_view>
#include <utility>

#include "core/errors.h"

namespace kvx {

// Long loops call Report now and then; it throws Cancelled when somebody asked for the work to stop. `cancel`
// may be asked on several threads at once, the sink is told on one at a time: loops on many threads, and
// those that have nothing to tell, call ThrowIfCancelled.
class Progress {
 public:
  using Sink = std::function<void(std::string_view stage, double fraction)>;  // fraction of the whole, 0..1
  using Cancel = std::function<bool()>;

  Progress() = default;
  Progress(Sink sink, Cancel cancel) : sink_(std::move(sink)), cancel_(std::move(cancel)) {}

  void Report(std::string_view stage, double fraction) const {
    ThrowIfCancelled();
    if (sink_) sink_(stage, begin_ + fraction * (end_ - begin_));
  }
  void ThrowIfCancelled() const {
    if (IsCancelled()) throw Cancelled();
  }
  bool IsCancelled() const { return cancel_ && cancel_(); }
  // A view whose 0..1 is [begin, end] of this one.
  Progress Part(double begin, double end) const {
    Progress part(sink_, cancel_);
    part.begin_ = begin_ + begin * (end_ - begin_);
    part.end_ = begin_ + end * (end_ - begin_);
    return part;
  }
  // A view that tells nobody, for work beside other work that does. It stops as this one does.
  Progress Silent() const { return Progress({}, cancel_); }

 private:
  Sink sink_;
  Cancel cancel_;
  double begin_ = 0, end_ = 1;
};

}  // namespace kvx
