// Variance within classes beside that of all; a sample in the air of one image alone is off by as much as
// the scan varies.
#include "pipeline/bones/search/correlation_ratio.h"

#include <algorithm>

namespace kvx {
namespace {

constexpr double kLeastNoise =
    0.02;  // variance that no pose explains, of the whole scan's: air is even anywhere
constexpr double kSilhouette = 1;  // variances of the scan

}  // namespace

void CorrelationRatio::Add(const CorrelationSums& greys, const CorrelationSums& in_air, bool air) {
  if (greys.count <= 0) return;
  count_ += greys.count, sum_ += greys.s, squares_ += greys.ss;
  between_ += double(greys.s) * greys.s / greys.count;
  ++classes_;
  if (air) air_of_template_ += in_air.count;
  air_of_scan_ += in_air.s;
  air_of_one_ += air ? in_air.count - in_air.s : in_air.s;
}

double CorrelationRatio::Value() const {
  if (count_ <= classes_ + 1 || classes_ < 2) return 0;
  const double noise = kLeastNoise * count_;
  const double by_chance = air_of_template_ + air_of_scan_ - 2 * air_of_template_ * air_of_scan_ / count_;
  const double total = squares_ - sum_ * sum_ / count_ + noise + kSilhouette * by_chance,
               within = squares_ - between_ + noise + kSilhouette * air_of_one_;
  return std::clamp(1 - within / total * (count_ - 1) / (count_ - classes_), 0.0, 1.0);
}

}  // namespace kvx
