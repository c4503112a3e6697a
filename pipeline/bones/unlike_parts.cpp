// Blocks of a bone, each correlated with the scan by itself.
#include "pipeline/bones/unlike_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/parallel.h"
#include "pipeline/bones/doubt_bone.h"

namespace kvx {
namespace {

constexpr double kBlockMm = 25;        // a patella's length; the small bones of a hand are a block each
constexpr double kOwn = 0.7;           // skinning weight of what moves with the bone
constexpr size_t kFewestVoxels = 300;  // of a block
constexpr double kStructure = 0.25;    // of the most varied block's variance; less is noise to correlate
constexpr double kUnlike = 0.35,
                 kAlike = 0.8;  // correlations of a part that moved otherwise, and of one that did not

struct Block {
  double n = 0, s = 0, t = 0, ss = 0, tt = 0, st = 0;

  void Add(double in_scan, double in_template) {
    n += 1, s += in_scan, t += in_template;
    ss += in_scan * in_scan, tt += in_template * in_template, st += in_scan * in_template;
  }
  double TemplateVariance() const { return tt / n - t / n * (t / n); }
  double Correlation() const {
    const double spread = (n * ss - s * s) * (n * tt - t * t);
    return spread > 0 ? (n * st - s * t) / std::sqrt(spread) : 0.0;
  }
};

std::vector<Block> BlocksOf(const BoneTissue& tissue, const CubicImage& scan, const RigidTransform& pose) {
  std::map<std::array<int, 3>, Block> blocks;
  for (const TissueSample& sample : tissue.samples) {
    if (sample.own_weight < kOwn) continue;
    const PointMm at = pose * PointMm{tissue.centre.lps + sample.from_centre_mm};
    double value;
    Eigen::Vector3d gradient;
    if (!scan.At(scan.grid().ToVox(at).ijk, value, gradient)) continue;
    const Eigen::Array3i cell = (sample.from_centre_mm / kBlockMm).array().round().cast<int>();
    blocks[{cell.x(), cell.y(), cell.z()}].Add(value, sample.value);
  }
  std::vector<Block> large;
  for (const auto& [cell, block] : blocks)
    if (size_t(block.n) >= kFewestVoxels) large.push_back(block);
  return large;
}

bool HasUnlikePart(const BoneTissue& tissue, const CubicImage& scan, const RigidTransform& pose) {
  const std::vector<Block> blocks = BlocksOf(tissue, scan, pose);
  double most_varied = 0, best = -1, least = 1;
  for (const Block& block : blocks) most_varied = std::max(most_varied, block.TemplateVariance());
  for (const Block& block : blocks) {
    if (block.TemplateVariance() < kStructure * most_varied) continue;
    best = std::max(best, block.Correlation()), least = std::min(least, block.Correlation());
  }
  return least < kUnlike && best > kAlike;
}

}  // namespace

void NameUnlikeParts(std::span<const BoneTissue> tissue, const CubicImage& scan, BoneFits& fits) {
  ParallelFor(fits.size(), [&](size_t b) {
    if (fits[b].Doubtful() || !HasUnlikePart(tissue[b], scan, fits[b].scan_from_template)) return;
    DoubtBone(
        fits[b],
        "a part of the bone does not match the scan where the rest does, as where two bones have one label "
        "or the scan is spoilt there");
  });
}

}  // namespace kvx
