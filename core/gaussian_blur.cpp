// Lines are copied out, weighted and written back.
#include "core/gaussian_blur.h"

#include <algorithm>
#include <cmath>

#include "core/grid_lines.h"
#include "core/parallel.h"

namespace kvx {
namespace {

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

}  // namespace

void BlurAlong(Volume& volume, int axis, const std::vector<float>& half_kernel) {
  const GridLines lines(volume.grid, axis);
  const size_t stride = lines.stride;
  const int length = lines.length, radius = int(half_kernel.size()) - 1;
  ParallelRanges(lines.count, [&](size_t begin, size_t end) {
    std::vector<float> line(static_cast<size_t>(length));
    for (size_t l = begin; l < end; ++l) {
      float* first = &volume.values[lines.First(l)];
      for (int i = 0; i < length; ++i) line[size_t(i)] = first[size_t(i) * stride];
      for (int i = 0; i < length; ++i) {
        float sum = half_kernel[0] * line[size_t(i)];
        for (int r = 1; r <= radius; ++r)
          sum += half_kernel[size_t(r)] *
                 (line[size_t(std::max(i - r, 0))] + line[size_t(std::min(i + r, length - 1))]);
        first[size_t(i) * stride] = sum;
      }
    }
  });
}

void BinomialBlur(Volume& volume, int times) {
  for (int pass = 0; pass < 3 * times; ++pass) BlurAlong(volume, pass % 3, {0.5f, 0.25f});
}

void GaussianBlur(Volume& volume, const Eigen::Vector3d& deviation_vox) {
  if (volume.values.empty()) return;
  for (int axis = 0; axis < 3; ++axis) {
    if (deviation_vox[axis] > 0) BlurAlong(volume, axis, HalfKernel(deviation_vox[axis]));
  }
}

}  // namespace kvx
