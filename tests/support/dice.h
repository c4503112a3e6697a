// How far two label maps agree about one label: twice the shared voxels over those of both.
#pragma once
#include "core/image.h"

namespace kvx::testing_support {

inline double Dice(const LabelMap& found, const LabelMap& truth, int label) {
  double both = 0, sum = 0;
  for (size_t v = 0; v < truth.values.size(); ++v) {
    both += found.values[v] == label && truth.values[v] == label;
    sum += (found.values[v] == label) + (truth.values[v] == label);
  }
  return 2 * both / sum;
}

}  // namespace kvx::testing_support
