// Pearson's correlation of two kinds of value at the same places, added up place by place.
#pragma once
#include <cmath>

namespace kvx {

class WeightedCorrelation {
 public:
  void Add(double weight, double a, double b) {
    n_ += weight, a_ += weight * a, b_ += weight * b;
    aa_ += weight * a * a, bb_ += weight * b * b, ab_ += weight * a * b;
  }
  double weight() const { return n_; }
  double VarianceOfSecond() const { return bb_ / n_ - b_ / n_ * (b_ / n_); }
  // -1 to 1; 0 where either kind is the same everywhere.
  double Value() const {
    const double spread = (n_ * aa_ - a_ * a_) * (n_ * bb_ - b_ * b_);
    return spread > 0 ? (n_ * ab_ - a_ * b_) / std::sqrt(spread) : 0.0;
  }

 private:
  double n_ = 0, a_ = 0, b_ = 0, aa_ = 0, bb_ = 0, ab_ = 0;
};

}  // namespace kvx
