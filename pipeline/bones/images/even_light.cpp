// Means over neighbourhoods on coarse voxels, where they are cheap; of bright voxels only, so that air and
// the outline of the body say nothing.
#include "pipeline/bones/images/even_light.h"

#include <algorithm>
#include <cmath>

#include "core/host/parallel.h"
#include "pipeline/bones/images/levels.h"
#include "pipeline/scans/air_level.h"
#include "pipeline/scans/extremes.h"
#include "pipeline/scans/grey_kind.h"

namespace kvx {
namespace {

constexpr double kCoarseMm = 6.0;
// Standard deviation of the neighbourhood beside the view's longest edge: fields of coils bend about so much,
// and bones are narrower.
constexpr double kPartOfView = 0.15;
constexpr double kFarFromBody = 0.05;  // of a neighbourhood is bright: below, the mean of all counts as much
constexpr double kMostChange = 4.0;

void SumAlong(Volume& volume, int axis, double sd_voxels) {
  const Eigen::Vector3i& size = volume.grid.size;
  const int reach = std::min(size[axis] - 1, int(std::ceil(2.5 * sd_voxels)));
  std::vector<float> kernel;
  for (int n = -reach; n <= reach; ++n)
    kernel.push_back(float(std::exp(-0.5 * n * n / (sd_voxels * sd_voxels))));
  const Volume before = volume;
  for (size_t v = 0; v < volume.values.size(); ++v) {
    Eigen::Vector3i at = volume.grid.Ijk(v);
    const int middle = at[axis];
    double sum = 0;
    for (int n = std::max(-reach, -middle); n <= std::min(reach, size[axis] - 1 - middle); ++n) {
      at[axis] = middle + n;
      sum += double(kernel[size_t(n + reach)]) * before(at.x(), at.y(), at.z());
    }
    volume.values[v] = float(sum);
  }
}

// Sums over neighbourhoods, as a part of what they are where nothing ends.
Volume Blurred(Volume volume, double sd_mm) {
  for (int axis = 0; axis < 3; ++axis) SumAlong(volume, axis, sd_mm / volume.grid.spacing_mm[axis]);
  return volume;
}

}  // namespace

Volume EvenlyLit(const Scan& scan) {
  const OwnOrLent<Volume> within_limits =
      WithoutExtremes(scan.volume, IsHounsfield(scan.volume, scan.modality));
  const Volume& volume = *within_limits;
  Volume bright = CoarsenedTo(volume, kCoarseMm), counted = bright;
  const std::optional<AirLevel> level = FindAirLevel(bright, scan.modality);
  if (!level || !IsMagnitude(volume)) return volume;
  const double threshold = OtsuThreshold(bright.values), dark = level->air;
  double sum = 0, count = 0;
  for (size_t v = 0; v < bright.values.size(); ++v) {
    const bool counts = bright.values[v] >= threshold;
    counted.values[v] = counts ? 1.0f : 0.0f;
    bright.values[v] = counts ? float(bright.values[v] - dark) : 0.0f;
    sum += bright.values[v], count += counted.values[v];
  }
  if (!(count > 0 && sum > 0)) return volume;
  const double mean = sum / count;
  const Grid& grid = volume.grid;
  const double sd_mm = kPartOfView * grid.spacing_mm.cwiseProduct(grid.size.cast<double>()).maxCoeff();
  bright = Blurred(std::move(bright), sd_mm), counted = Blurred(std::move(counted), sd_mm);
  const double few = kFarFromBody * *std::max_element(counted.values.begin(), counted.values.end());
  for (size_t v = 0; v < bright.values.size(); ++v)
    bright.values[v] = float((bright.values[v] / mean + few) / (counted.values[v] + few));  // the shading
  bright = OnFinerGrid(std::move(bright), grid);
  ParallelEach(bright.values.size(), [&](size_t v) {
    const double shade = std::clamp(double(bright.values[v]), 1 / kMostChange, kMostChange);
    bright.values[v] = float(dark + (volume.values[v] - dark) / shade);
  });
  return bright;
}

}  // namespace kvx
