// Samples of B*, and the spline's basis at the voxels inside the ball.
#include "pipeline/registration/paper/block_window.h"

#include <algorithm>
#include <cmath>

#include "core/mutual_information.h"
#include "core/voxels/sample_clamped.h"
#include "core/voxels/voxel_box.h"
#include "pipeline/registration/paper/pinned_spline.h"

namespace kvx {
namespace {

constexpr IntensityRange kBytes{0, 255};
constexpr double kRadius = kSupportVoxels / 2.0;

Eigen::Vector3i FirstVoxel(const BlockIndex& block) { return kBlockVoxels * block; }
Eigen::Vector3d Centre(const BlockIndex& block) {
  return FirstVoxel(block).cast<double>() + Eigen::Vector3d::Constant((kBlockVoxels - 1) / 2.0);
}

template <class Visit>
void ForEachVoxel(const Grid& grid, const BlockIndex& block, BlockPart part, Visit visit) {
  const int margin = part == BlockPart::kWithNeighbours ? kBlockVoxels : 0;
  const Eigen::Vector3i lo = (FirstVoxel(block).array() - margin).max(0);
  const Eigen::Vector3i hi = (FirstVoxel(block).array() + kBlockVoxels + margin).min(grid.size.array());
  ForEachVoxel(VoxelBox{lo, hi},
               [&](const Eigen::Vector3i& p) { visit(p, grid.Index(p.x(), p.y(), p.z())); });
}

Eigen::Vector3d InBall(const Eigen::Vector3d& voxel, const BlockIndex& block) {
  return (voxel - Centre(block)) / kRadius;
}

// Bone voxels of the ball, each one as far as possible from those before it.
std::vector<Eigen::Vector3d> SpreadBoneVoxels(const PaperLevel& level, const BlockIndex& block) {
  std::vector<Eigen::Vector3d> all, chosen;
  ForEachVoxel(level.bone.grid, block, BlockPart::kWithNeighbours, [&](const Eigen::Vector3i& p, size_t v) {
    const Eigen::Vector3d at = InBall(p.cast<double>(), block);
    if (level.bone.values[v] && at.norm() < 1 - PinnedSpline::kLeastGap) all.push_back(at);
  });
  if (all.empty()) return chosen;
  std::vector<double> gap(all.size(), INFINITY);
  size_t next =
      size_t(std::ranges::min_element(all, {}, [](const auto& p) { return p.norm(); }) - all.begin());
  for (int n = 0; n < 2 * PinnedSpline::kMostFixed && gap[next] > 0; ++n) {
    chosen.push_back(all[next]);
    for (size_t i = 0; i < all.size(); ++i) gap[i] = std::min(gap[i], (all[i] - chosen.back()).norm());
    next = size_t(std::ranges::max_element(gap) - gap.begin());
  }
  return chosen;
}

PinnedSpline SplineOf(const PaperLevel& level, const BlockIndex& block) {
  std::array<bool, kControlPoints> in_bone{};
  const BlockSpline corners;
  for (size_t a = 0; a < kControlPoints; ++a) {
    const Eigen::Vector3d at = Centre(block) + kRadius * corners.control_points()[a];
    const Eigen::Vector3i p = at.array().round().cast<int>();
    in_bone[a] = level.bone.grid.Contains(p) && level.bone(p.x(), p.y(), p.z());
  }
  return PinnedSpline(in_bone, SpreadBoneVoxels(level, block));
}

}  // namespace

std::vector<size_t> CountingVoxels(const PaperLevel& level, const BlockIndex& block, BlockPart part) {
  std::vector<size_t> out;
  ForEachVoxel(level.counts.grid, block, part, [&](const Eigen::Vector3i&, size_t v) {
    if (level.counts.values[v]) out.push_back(v);
  });
  return out;
}

namespace {

// Spread over two bins, one grey value alone would look like detail without any match.
bool Flat(std::span<const float> values) {
  const auto [low, high] = std::ranges::minmax(values);
  return high - low < kBytes.high / (kMutualInformationBins - 1);
}

}  // namespace

double Mismatch(bool by_information, std::span<const float> target, std::span<const float> source) {
  if (target.empty()) return 0;
  if (by_information) {
    if (Flat(target) || Flat(source)) return 0;
    const std::vector<float> ones(target.size(), 1.0f);
    return 1 - EstimateMutualInformation(source, target, ones, kBytes, kBytes).normalised;
  }
  double squares = 0;
  for (size_t n = 0; n < target.size(); ++n) {
    const double difference = double(target[n]) - source[n];
    squares += difference * difference;
  }
  return std::sqrt(squares / double(target.size()));
}

BlockWindow::BlockWindow(const PaperLevel& level, const Volume& deformed, const BlockIndex& block)
    : level_(level), deformed_(deformed) {
  const PinnedSpline spline = SplineOf(level, block);
  free_points_ = spline.free_count();
  ForEachVoxel(level.source.grid, block, BlockPart::kWithNeighbours, [&](const Eigen::Vector3i& p, size_t v) {
    int sample = -1;
    if (level.counts.values[v]) {
      sample = int(target_.size());
      target_.push_back(level.target.values[v]);
      source_.push_back(deformed.values[v]);
    }
    const Eigen::Vector3d in_ball = InBall(p.cast<double>(), block);
    if (in_ball.norm() >= 1) return;
    moving_.push_back({v, sample, p.cast<float>()});
    const Eigen::RowVectorXd row = spline.Basis(in_ball);
    for (int a = 0; a < free_points_; ++a) basis_.push_back(float(row[a]));
  });
}

Eigen::Vector3f BlockWindow::Shift(size_t moving, std::span<const double> displacements) const {
  Eigen::Vector3f shift = Eigen::Vector3f::Zero();
  const float* row = basis_.data() + moving * size_t(free_points_);
  for (int c = 0; c < 3; ++c) {
    for (int a = 0; a < free_points_; ++a)
      shift[c] += row[a] * float(displacements[size_t(c * free_points_ + a)]);
  }
  return shift;
}

double BlockWindow::Cost(std::span<const double> displacements) const {
  std::vector<float> source = source_;
  for (size_t n = 0; n < moving_.size(); ++n) {
    if (moving_[n].sample < 0) continue;
    source[size_t(moving_[n].sample)] =
        SampleClamped(deformed_, PointVox{(moving_[n].at + Shift(n, displacements)).cast<double>()});
  }
  return Mismatch(level_.by_information(), target_, source);
}

std::vector<size_t> BlockWindow::Compose(std::span<const double> displacements, VoxelShifts& shifts) const {
  std::vector<Eigen::Vector3f> composed(moving_.size());
  for (size_t n = 0; n < moving_.size(); ++n) {
    const Eigen::Vector3f u = Shift(n, displacements);
    composed[n] = u + SampleTrilinear(shifts, PointVox{(moving_[n].at + u).cast<double>()}).cast<float>();
  }
  std::vector<size_t> changed;
  for (size_t n = 0; n < moving_.size(); ++n) {
    shifts.values[moving_[n].voxel] = composed[n];
    changed.push_back(moving_[n].voxel);
  }
  return changed;
}

}  // namespace kvx
