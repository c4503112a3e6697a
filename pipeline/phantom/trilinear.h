// Values between the samples of a grid.
#pragma once
#include <Eigen/Dense>
#include <optional>
#include <vector>

namespace kvx::phantom {

// At p, in steps from the first sample; x fastest in memory. Nothing outside of the samples' hull.
inline std::optional<double> TrilinearAt(const std::vector<float>& samples, const Eigen::Vector3i& size,
                                         const Eigen::Vector3d& p) {
  if ((p.array() < 0).any() || (p.array() >= (size.cast<double>().array() - 1)).any()) return std::nullopt;
  const Eigen::Vector3i c = p.cast<int>();
  const Eigen::Vector3d f = p - c.cast<double>();
  const size_t row = size_t(size.x()), plane = row * size.y();
  const float* v = &samples[c.z() * plane + c.y() * row + c.x()];
  const auto along_x = [&](const float* w) { return w[0] + f.x() * (w[1] - w[0]); };
  const auto along_y = [&](const float* w) { return along_x(w) + f.y() * (along_x(w + row) - along_x(w)); };
  return along_y(v) + f.z() * (along_y(v + plane) - along_y(v));
}

}  // namespace kvx::phantom
