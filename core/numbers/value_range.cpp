// Sixteen values at a time, each compared with those sixteen places before.
#include "core/numbers/value_range.h"

#include <Eigen/Core>

namespace kvx {
namespace {

constexpr size_t kLanes = 16;
constexpr size_t kStretch = 1 << 14;  // values that one thread takes at a time

ValueRange RangeOfStretch(std::span<const float> values) {
  using Lanes = Eigen::Array<float, kLanes, 1>;
  ValueRange range;
  Lanes least = Lanes::Constant(range.least), most = Lanes::Constant(range.most);
  size_t v = 0;
  for (; v + kLanes <= values.size(); v += kLanes) {
    const Lanes own = Eigen::Map<const Lanes>(&values[v]);
    least = least.min(own), most = most.max(own);
  }
  for (size_t n = 0; n < kLanes; ++n) range += {least[Eigen::Index(n)], most[Eigen::Index(n)]};
  for (; v < values.size(); ++v) range += {values[v], values[v]};
  return range;
}

}  // namespace

ValueRange ValueRangeOf(std::span<const float> values) {
  return ParallelSum<ValueRange>((values.size() + kStretch - 1) / kStretch,
                                 [&](ValueRange& so_far, size_t s) {
                                   const auto from = values.subspan(s * kStretch);
                                   so_far += RangeOfStretch(from.first(std::min(kStretch, from.size())));
                                 });
}

}  // namespace kvx
