// The bones of a hand as five chains that start at the carpal block.
#pragma once
#include <vector>

#include "pipeline/segmentation/names/label_shapes.h"

namespace kvx {

struct FingerChain {
  std::vector<size_t> bones;       // numbers of shapes, from the carpals outwards
  std::vector<double> confidence;  // that each goes on from the one before, 0 to 1
};

struct FingerChains {
  size_t carpals = 0;                // number of the shape
  std::vector<FingerChain> fingers;  // thumb to little finger; empty when the shapes are no hand
  double confidence = 0;             // of carpals, thumb and order
};

// `gaps` as of EndGapsMm. A hand has all five metacarpals; ends of fingers may be missing, which costs
// confidence.
FingerChains FindFingerChains(const std::vector<LabelShape>& shapes,
                              const std::vector<std::vector<double>>& gaps);

}  // namespace kvx
