// Plain loops over unowned voxels.
#include "kernels/reference/fill_gaps.h"

namespace kvx::reference {
namespace {

constexpr uint32_t kNone = 0xFFFFFFFFu;
constexpr int kWidest = 3;

int StepsToBody(const std::vector<uint32_t>& owner, const Grid& grid, const Eigen::Vector3i& from,
                const Eigen::Vector3i& step) {
  for (int d = 1; d < kWidest; ++d) {
    const Eigen::Vector3i at = from + d * step;
    if (!grid.Contains(at)) return 0;
    const uint32_t o = owner[grid.Index(at.x(), at.y(), at.z())];
    if (o != kNone) return (o >> 30) == 0 ? d : 0;
  }
  return 0;
}

}  // namespace

void FillGaps(const std::vector<uint32_t>& owner, float air, Volume& values) {
  const Grid& grid = values.grid;
  const std::vector<float> before_filling = values.values;
  const auto value = [&](const Eigen::Vector3i& p) { return double(before_filling[grid.Index(p.x(), p.y(), p.z())]); };
  for (size_t v = 0; v < values.values.size(); ++v) {
    if (owner[v] != kNone || before_filling[v] != air) continue;
    const Eigen::Vector3i p = grid.Ijk(v);
    double sum = 0, weight = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3i step = Eigen::Vector3i::Unit(axis);
      const int low = StepsToBody(owner, grid, p, -step), high = StepsToBody(owner, grid, p, step);
      if (low == 0 || high == 0 || low + high > kWidest) continue;
      const double w = 1.0 / (low + high);
      sum += w * w * (value(p - low * step) * high + value(p + high * step) * low);
      weight += w;
    }
    if (weight > 0) values.values[v] = float(sum / weight);
  }
}

}  // namespace kvx::reference
