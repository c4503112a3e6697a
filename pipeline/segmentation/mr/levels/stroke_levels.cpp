#include "pipeline/segmentation/mr/levels/stroke_levels.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/numbers/quantile.h"
#include "pipeline/segmentation/mr/levels/air_around.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"

namespace kvx {

std::map<int, double> MarrowLevels(const Volume& scan, const LabelMap& strokes) {
  std::map<int, std::vector<float>> marked;
  for (size_t v = 0; v < strokes.values.size(); ++v) {
    if (strokes.values[v] != 0) marked[strokes.values[v]].push_back(scan.values[v]);
  }
  std::map<int, double> levels;
  for (auto& [label, values] : marked) {
    levels[label] = std::max(double(TakeQuantile(values, 0.85)), 1e-6);
  }
  return levels;
}

LabelMap AirBeside(const Volume& scan, const std::map<int, double>& marrow_levels) {
  double dimmest = INFINITY;
  for (const auto& [label, level] : marrow_levels) {
    if (label != kBackgroundStroke) dimmest = std::min(dimmest, level);
  }
  return AirAround(scan, dimmest);
}

}  // namespace kvx
