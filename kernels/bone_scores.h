// Correlation of one bone of the template with a scan for many candidate poses at once, on the device (eq. 1
// with gain and bias free).
#pragma once
#include <span>
#include <vector>

#include "core/image.h"
#include "kernels/device/device_buffer.h"

namespace kvx {

using BoneSample = Eigen::Vector4f;  // (mm about the bone's centroid, template value)
using VoxFromSample = Eigen::Matrix<float, 3, 4, Eigen::RowMajor>;  // one candidate pose, to scan voxels

struct CorrelationSums {
  float count = 0, t = 0, tt = 0, s = 0, ss = 0, ts = 0;  // over samples that fall into the scan
  float unused[2] = {0, 0};
};
// -1..1; 0 where fewer than 2 samples or no contrast.
double Correlation(const CorrelationSums& sums);

// A scan on the device. Values should be centred and scaled to about 1: sums are in single precision.
struct DeviceScan {
  DeviceScan(Backend& backend, const Volume& scan);
  Grid grid;
  DeviceBuffer<float> values;  // and a 0 after the last: values are read in pairs
};

// How many of `samples` are looked at with a step.
size_t SamplesAtStep(size_t samples, int step);

class BoneScores {
 public:
  explicit BoneScores(Backend& backend);

  // With a `step` of n, only about every n-th sample is looked at, spread evenly over them.
  std::vector<CorrelationSums> operator()(const DeviceScan& scan, std::span<const BoneSample> samples,
                                          std::span<const VoxFromSample> candidates, int step = 1) const;

 private:
  Backend& backend_;
  cl::Program program_;
};

}  // namespace kvx
