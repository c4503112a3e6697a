// Each node starts at the template place of the nearest tissue sample and goes on by Newton steps.
#include "pipeline/posing/inverse_grid.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "core/host/parallel.h"
#include "core/voxels/neighbours.h"

namespace kvx {
namespace {

constexpr size_t kSamples = 60000;  // of the body's voxels
constexpr int kNewtonSteps = 6;
constexpr double kProbeMm = 0.2, kNearEnoughMm = 1e-3;
constexpr size_t kAtOnce = 512;
constexpr size_t kNodesPerLook = size_t(1) << 16;  // between two questions whether to go on

struct Sample {
  PointMm in_template, posed;
};

std::vector<Sample> Samples(const PosingEngine& engine, const Mask& body, const ResolvedPose& pose,
                            const Progress& progress) {
  const size_t inside =
      size_t(std::count_if(body.values.begin(), body.values.end(), [](uint8_t v) { return v != 0; }));
  if (inside == 0) throw InputError("the model has no body");
  const size_t step = std::max<size_t>(1, inside / kSamples);
  std::vector<PointMm> points;
  size_t seen = 0;
  for (size_t v = 0; v < body.values.size(); ++v) {
    if (body.values[v] && seen++ % step == 0)
      points.push_back(body.grid.ToMm(PointVox{body.grid.Ijk(v).cast<double>()}));
  }
  std::vector<Sample> out(points.size());
  ParallelFor((points.size() + kAtOnce - 1) / kAtOnce, [&](size_t part) {
    progress.ThrowIfCancelled();
    const size_t begin = part * kAtOnce, end = std::min(begin + kAtOnce, points.size());
    const auto posed = engine.MapPoints(
        pose, {points.begin() + std::ptrdiff_t(begin), points.begin() + std::ptrdiff_t(end)});
    for (size_t p = begin; p < end; ++p) out[p] = {points[p], posed[p - begin]};
  });
  return out;
}

// The nearest sample of every node: each node's own cell first, then ring by ring from node to node.
std::vector<int32_t> NearestSamples(const Grid& grid, const std::vector<Sample>& samples,
                                    const Progress& progress) {
  std::vector<int32_t> nearest(grid.VoxelCount(), -1);
  const auto distance = [&](size_t node, int32_t sample) {
    return (grid.ToMm(PointVox{grid.Ijk(node).cast<double>()}).lps - samples[size_t(sample)].posed.lps)
        .squaredNorm();
  };
  const auto offer = [&](size_t node, int32_t sample) {
    if (nearest[node] >= 0 && distance(node, nearest[node]) <= distance(node, sample)) return false;
    nearest[node] = sample;
    return true;
  };
  for (size_t s = 0; s < samples.size(); ++s) {
    const Eigen::Vector3i at = grid.ToVox(samples[s].posed).ijk.array().round().cast<int>();
    if (grid.Contains(at)) offer(grid.Index(at.x(), at.y(), at.z()), int32_t(s));
  }
  // To and fro, so that a sample comes far in every pass. Ends: every change lessens a node's distance.
  for (bool changed = true, forth = true; changed; forth = !forth) {
    changed = false;
    for (size_t n = 0; n < nearest.size(); ++n) {
      if (n % kNodesPerLook == 0) progress.ThrowIfCancelled();
      const size_t node = forth ? n : nearest.size() - 1 - n;
      const Eigen::Vector3i at = grid.Ijk(node);
      for (int side = 0; side < 6; ++side) {
        const Eigen::Vector3i other = at + StepToSide(side);
        if (!grid.Contains(other)) continue;
        const int32_t sample = nearest[grid.Index(other.x(), other.y(), other.z())];
        if (sample >= 0) changed = offer(node, sample) || changed;
      }
    }
  }
  return nearest;
}

PointMm Solved(const PosingEngine& engine, const ResolvedPose& pose, const PointMm& wanted,
               const Sample& start) {
  PointMm best = start.in_template, at = best;
  double least = (start.posed.lps - wanted.lps).norm();
  for (int step = 0; step < kNewtonSteps && least > kNearEnoughMm; ++step) {
    std::vector<PointMm> probes{at};
    for (int a = 0; a < 3; ++a) probes.push_back({at.lps + kProbeMm * Eigen::Vector3d::Unit(a)});
    const std::vector<PointMm> posed = engine.MapPoints(pose, probes);
    const Eigen::Vector3d miss = wanted.lps - posed[0].lps;
    if (miss.norm() < least) least = miss.norm(), best = at;
    Eigen::Matrix3d slope;
    for (int a = 0; a < 3; ++a) slope.col(a) = (posed[size_t(a) + 1].lps - posed[0].lps) / kProbeMm;
    if (std::abs(slope.determinant()) < 0.05) break;  // a fold: the best so far stays
    at.lps += slope.inverse() * miss;
  }
  return best;
}

void StateErrors(InverseGrid& out, const std::vector<Sample>& samples) {
  const DisplacementField& field = out.template_from_posed;
  std::vector<double> errors;
  for (const Sample& sample : samples) {
    const Eigen::Vector3d back = sample.posed.lps + SampleTrilinear(field, field.grid.ToVox(sample.posed));
    errors.push_back((back - sample.in_template.lps).norm());
    out.mean_error_mm += errors.back() / double(samples.size());
  }
  std::sort(errors.begin(), errors.end());
  out.largest_error_mm = errors.back();
  out.p99_error_mm = errors[size_t(0.99 * double(errors.size() - 1))];
}

}  // namespace

InverseGrid CoarseInverse(const PosingEngine& engine, const Mask& body, const ResolvedPose& pose, int level,
                          const Progress& progress) {
  const Grid grid = engine.FittedGrid(pose, level);
  const std::vector<Sample> samples = Samples(engine, body, pose, progress);
  const std::vector<int32_t> nearest = NearestSamples(grid, samples, progress);
  InverseGrid out;
  out.template_from_posed = DisplacementField(grid, Eigen::Vector3f::Zero());
  ParallelFor((nearest.size() + kAtOnce - 1) / kAtOnce, [&](size_t part) {
    progress.ThrowIfCancelled();
    for (size_t node = part * kAtOnce; node < std::min((part + 1) * kAtOnce, nearest.size()); ++node) {
      if (nearest[node] < 0) continue;
      const PointMm wanted = grid.ToMm(PointVox{grid.Ijk(node).cast<double>()});
      const Sample& start = samples[size_t(nearest[node])];
      const bool near = (wanted.lps - start.posed.lps).norm() < 2 * grid.spacing_mm.norm();
      // Far from tissue the displacement of the nearest tissue goes on.
      const Eigen::Vector3d d = near ? Eigen::Vector3d(Solved(engine, pose, wanted, start).lps - wanted.lps)
                                     : Eigen::Vector3d(start.in_template.lps - start.posed.lps);
      out.template_from_posed.values[node] = d.cast<float>();
    }
  });
  StateErrors(out, samples);
  return out;
}

}  // namespace kvx
