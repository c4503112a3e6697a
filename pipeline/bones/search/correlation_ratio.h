// How well classes of samples tell what a scan shows at them, whatever grey each class has there.
#pragma once
#include "kernels/bone_scores.h"

namespace kvx {

// Correlation ratio (Roche et al. 1998) of classes of the template's samples with a scan whose values have
// variance 1, and of their silhouettes: air must lie in air. A class that lies in air is told by its greys
// as well as one that lies in tissue, and without silhouettes a bone's edge matches the edge of a limb best.
class CorrelationRatio {
 public:
  // A class' sums over the scan, and over its air (1, else 0); `air`: whether the class is the template's.
  void Add(const CorrelationSums& greys, const CorrelationSums& in_air, bool air);
  // 0..1, less what as many classes tell of pure noise.
  double Value() const;
  double Count() const { return count_; }

 private:
  double count_ = 0, sum_ = 0, squares_ = 0, between_ = 0;
  double air_of_template_ = 0, air_of_scan_ = 0, air_of_one_ = 0;  // samples
  int classes_ = 0;
};

}  // namespace kvx
