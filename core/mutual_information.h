// Mutual information of paired intensities (paper, eq. 5) from a Parzen-smoothed joint histogram.
#pragma once
#include <span>

namespace kvx {

struct IntensityRange {
  float low = 0, high = 1;  // centres of the first and the last bin; values beyond are clamped
};

struct MutualInformation {
  double nats = 0;
  // By the smaller marginal entropy; 1 where either image is flat (nothing mismatches)
  double normalised = 0;
  double smaller_entropy_nats = 0;
};

// Samples with weight 0 do not count. Each sample is spread over its two nearest bins per axis (linear Parzen
// window), so the estimate is continuous in the intensities.
MutualInformation EstimateMutualInformation(std::span<const float> template_values,
                                            std::span<const float> scan_values,
                                            std::span<const float> weights,
                                            const IntensityRange& template_range,
                                            const IntensityRange& scan_range);

constexpr int kMutualInformationBins = 24;  // per axis

}  // namespace kvx
