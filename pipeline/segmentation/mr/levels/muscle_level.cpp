// Air is left out by its noise, cortex, tendons and skin by a ball that does not fit into them.
#include "pipeline/segmentation/mr/levels/muscle_level.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"
#include "core/voxels/dilated.h"
#include "core/voxels/gaussian_blur.h"
#include "core/voxels/to_corner.h"
#include "core/voxels/voxel_box.h"
#include "pipeline/segmentation/mr/levels/marrow_level.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"

namespace kvx {
namespace {

constexpr double kAroundMm = 30;      // of the box of all bones' strokes
constexpr double kBallMm = 5;         // of radius: fits into muscle
constexpr double kBlurVoxels = 0.6;   // against noise
constexpr size_t kEnoughVoxels = 30;  // that are the middle of such a ball
constexpr int kBoxVoxels = 4;         // along each edge
constexpr double kDeviations = 6;     // of air's noise above air: tissue
constexpr float kDimmest = 0.02;      // of marrow; darker is no signal, even of a scan without noise
constexpr double kDarkest = 0.08;     // of marrow; there would be more noise in muscle than muscle

Mask OfBones(const LabelMap& strokes) {
  Mask bones(strokes.grid);
  for (size_t v = 0; v < bones.values.size(); ++v) bones.values[v] = IsOfBone(strokes.values[v]);
  return bones;
}

// Read from the strokes of all bones: a coil's field is the same for all.
MarrowLevel MarrowOf(const Volume& scan, const LabelMap& strokes) {
  return MarrowLevel(SamplesOf(scan, OfBones(strokes)));
}

// Of voxels in a box of the view.
struct Noise {
  double mean = 0, deviation = 0, least = 0;
  double Above() const { return mean + kDeviations * deviation; }
};

Noise NoiseIn(const Volume& scan, const Eigen::Vector3i& low) {
  const Eigen::Vector3i high = (low.array() + kBoxVoxels).min(scan.grid.size.array());
  double sum = 0, squares = 0, least = std::numeric_limits<double>::infinity();
  ForEachVoxel({low, high}, [&](const Eigen::Vector3i& p) {
    const double grey = scan(p.x(), p.y(), p.z());
    sum += grey, squares += grey * grey, least = std::min(least, grey);
  });
  const double count = (high - low).prod(), mean = sum / count;
  return {mean, std::sqrt(std::max(0.0, squares / count - mean * mean)), least};
}

Noise OfDarkestCorner(const Volume& scan) {
  std::vector<Noise> corners;
  const Eigen::Vector3i last = (scan.grid.size.array() - kBoxVoxels).max(0);
  for (int corner = 0; corner < 8; ++corner)
    corners.push_back(NoiseIn(scan, ToCorner(corner).cwiseProduct(last)));
  return *std::ranges::min_element(corners, {}, &Noise::mean);
}

// Of boxes without a voxel as dark as what a program put there.
double LeastBeside(double mask, const Volume& scan) {
  double least = std::numeric_limits<double>::infinity();
  const Eigen::Vector3i boxes = scan.grid.size / kBoxVoxels;
  ForEachVoxel({Eigen::Vector3i::Zero(), boxes}, [&](const Eigen::Vector3i& box) {
    const Noise noise = NoiseIn(scan, kBoxVoxels * box);
    if (noise.least > mask && noise.deviation > 0) least = std::min(least, noise.Above());
  });
  return std::isfinite(least) ? least : mask;
}

// What is brighter is tissue. The darkest corner holds air in nearly every scan, or what a program put there.
double LeastTissue(const Volume& smooth) {
  const Noise corner = OfDarkestCorner(smooth);
  return corner.deviation > 0 ? corner.Above() : LeastBeside(corner.mean, smooth);
}

VoxelBox AroundBones(const LabelMap& strokes) {
  return GrownByMm(BoxOf(OfBones(strokes)), kAroundMm, strokes.grid);
}

// `relative`: intensities to marrow's.
std::optional<double> MuscleIn(const Volume& scan, const Volume& relative, const LabelMap& strokes) {
  Volume smooth = scan;
  GaussianBlur(smooth, Eigen::Vector3d::Constant(kBlurVoxels));
  const double least = LeastTissue(smooth);
  const VoxelBox around = AroundBones(strokes);
  Volume beside = Cropped(relative, around);
  GaussianBlur(beside, Eigen::Vector3d::Constant(kBlurVoxels));
  smooth = Cropped(smooth, around);
  Mask dark(smooth.grid);
  for (size_t v = 0; v < dark.values.size(); ++v) {
    const float r = beside.values[v];
    dark.values[v] = smooth.values[v] > least && r > kDimmest && r < kSurelyMarrow;
  }
  const Mask middles = Eroded(dark, std::max(kBallMm, 1.01 * dark.grid.spacing_mm.maxCoeff()));
  std::vector<float> seen;
  for (size_t v = 0; v < middles.values.size(); ++v)
    if (middles.values[v]) seen.push_back(beside.values[v]);
  if (seen.size() < kEnoughVoxels) return std::nullopt;
  const double level = TakeMedian(seen);
  return level < kDarkest ? std::nullopt : std::optional(level);
}

}  // namespace

std::optional<double> MuscleLevel(const Volume& scan, const LabelMap& strokes) {
  const MarrowLevel marrow = MarrowOf(scan, strokes);
  return marrow.empty() ? std::nullopt : MuscleIn(scan, RelativeTo(marrow, scan), strokes);
}

UsualMuscle WithUsualMuscle(const Volume& scan, const LabelMap& strokes) {
  const MarrowLevel marrow = MarrowOf(scan, strokes);
  if (marrow.empty()) return {scan};
  Volume relative = RelativeTo(marrow, scan);
  const std::optional<double> muscle = MuscleIn(scan, relative, strokes);
  if (!muscle || *muscle >= kUsualMuscle) return {scan};
  const double below = kUsualMuscle / *muscle, above = (1 - kUsualMuscle) / (1 - *muscle);
  ParallelEach(relative.values.size(), [&](size_t v) {
    const double r = relative.values[v], grey = scan.values[v];
    const double factor = r < *muscle ? below : r < 1 ? (1 - above * (1 - r)) / r : 1;
    relative.values[v] = float(factor * grey);
  });
  return {std::move(relative), 1 - *muscle / kUsualMuscle};
}

}  // namespace kvx
