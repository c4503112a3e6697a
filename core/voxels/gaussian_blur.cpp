// Lines go on at both ends, then the sums need not ask where they are.
#include "core/voxels/gaussian_blur.h"

#include <cmath>

#include "core/voxels/line_bundles.h"

namespace kvx {
namespace {

using Rows = std::vector<BundleRow<float>>;

// The centre's weight, then those of one side; with the other side they add to 1.
std::vector<float> HalfKernel(double deviation_vox) {
  std::vector<float> kernel(size_t(std::ceil(3 * deviation_vox)) + 1);
  for (size_t r = 0; r < kernel.size(); ++r)
    kernel[r] = float(std::exp(-0.5 * double(r * r) / (deviation_vox * deviation_vox)));
  float sum = kernel[0];
  for (size_t r = 1; r < kernel.size(); ++r) sum += 2 * kernel[r];
  for (float& weight : kernel) weight /= sum;
  return kernel;
}

// (1 2 1) / 4 along the rows, in place.
void SmoothOnce(Rows& rows) {
  BundleRow<float> before = rows.front();
  for (size_t i = 0; i < rows.size(); ++i) {
    const BundleRow<float> own = rows[i];
    rows[i] = 0.5f * own + 0.25f * (before + rows[std::min(i + 1, rows.size() - 1)]);
    before = own;
  }
}

}  // namespace

void BlurAlong(Volume& volume, int axis, const std::vector<float>& half_kernel) {
  const size_t radius = half_kernel.size() - 1;
  ForEachLineBundle<float>(volume, axis, [&, around = Rows()](Rows& rows) mutable {
    around.assign(radius, rows.front());
    around.insert(around.end(), rows.begin(), rows.end());
    around.insert(around.end(), radius, rows.back());
    for (size_t i = 0; i < rows.size(); ++i) {
      BundleRow<float> sum = half_kernel[0] * around[i + radius];
      for (size_t r = 1; r <= radius; ++r)
        sum += half_kernel[r] * (around[i + radius - r] + around[i + radius + r]);
      rows[i] = sum;
    }
  });
}

// One axis after the other: the order is that of rounding alone, and a line stays at hand for all its passes.
void BinomialBlur(Volume& volume, int times) {
  if (volume.values.empty()) return;
  for (int axis = 0; axis < 3; ++axis) {
    ForEachLineBundle<float>(volume, axis, [times](Rows& rows) {
      for (int n = 0; n < times; ++n) SmoothOnce(rows);
    });
  }
}

void GaussianBlur(Volume& volume, const Eigen::Vector3d& deviation_vox) {
  if (volume.values.empty()) return;
  for (int axis = 0; axis < 3; ++axis) {
    if (deviation_vox[axis] > 0) BlurAlong(volume, axis, HalfKernel(deviation_vox[axis]));
  }
}

}  // namespace kvx
