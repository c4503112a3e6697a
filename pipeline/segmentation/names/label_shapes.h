// Size, place and long axis of every label of a label map.
#pragma once
#include <vector>

#include "core/image.h"

namespace kvx {

struct LabelShape {
  int label = 0;
  size_t voxels = 0;
  PointMm centre;
  double elongation = 1;  // standard deviation along the long axis to that along the next
  PointMm ends[2];        // of the long axis, where the label's voxels end along it
};

std::vector<LabelShape> LabelShapes(const LabelMap& labels);  // in the order of labels, without 0

// gap[2 * a + e][b]: how far end e of label a is from the nearest voxel of label b, in mm; 0 for b = a.
std::vector<std::vector<double>> EndGapsMm(const LabelMap& labels, const std::vector<LabelShape>& shapes);

}  // namespace kvx
