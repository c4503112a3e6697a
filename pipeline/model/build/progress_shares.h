// The parts of a progress, in proportion to what each step is expected to cost.
#pragma once
#include <algorithm>

#include "core/host/progress.h"

namespace kvx {

class ProgressShares {
 public:
  // `total`: the sum of all costs to come, in any unit.
  ProgressShares(const Progress& whole, double total) : whole_(whole), total_(total) {}
  Progress Next(double cost) {
    const double begin = done_ / total_;
    done_ += cost;
    return whole_.Part(begin, std::min(1.0, done_ / total_));
  }

 private:
  const Progress& whole_;
  double total_, done_ = 0;
};

}  // namespace kvx
