// Blocks and pieces of a bone, each correlated with the scan by itself: blocks where two bones touch, pieces
// where one lies beside the other.
#include "pipeline/bones/judge/unlike_parts.h"

#include <algorithm>
#include <array>
#include <map>

#include "core/bone_of_label.h"
#include "core/host/parallel.h"
#include "core/voxels/components.h"
#include "core/voxels/label_mask.h"
#include "core/voxels/voxel_box.h"
#include "pipeline/bones/judge/doubt_bone.h"
#include "pipeline/bones/refine/weighted_correlation.h"

namespace kvx {
namespace {

constexpr double kBlockMm = 25;        // a patella's length; the small bones of a hand are a block each
constexpr double kOwn = 0.7;           // skinning weight of what moves with the bone
constexpr size_t kFewestVoxels = 300;  // of a block
constexpr double kFewestInBone = 100;  // of them that tell by themselves
constexpr double kStructure = 0.25;    // of the most varied block's variance; less is noise to correlate
// Correlations of a part that moved otherwise, and of one that did not
constexpr double kUnlike = 0.4, kAlike = 0.8;

// The scan with the template, and what of that is in the bone. At a joint other tissue lies beside a bone in
// every pose: a part that matches by itself has not moved otherwise.
struct Block {
  WeightedCorrelation all, in_bone;
  void Add(double scan, const TissueSample& sample) {
    all.Add(1, scan, sample.value);
    if (sample.away_mm <= 0) in_bone.Add(1, scan, sample.value);
  }
  double Value() const {
    return in_bone.weight() < kFewestInBone ? all.Value() : std::max(all.Value(), in_bone.Value());
  }
};

std::vector<VoxelBox> BoxesOf(const BoneSet& bones) {
  const std::vector<int> bone_of_label = BoneOfLabel(bones.bones);
  std::vector<VoxelBox> boxes(bones.bones.size());
  for (size_t v = 0; v < bones.labels.values.size(); ++v) {
    const int b = bone_of_label[bones.labels.values[v]];
    if (b != kNoBone) boxes[size_t(b)].Include(bones.labels.grid.Ijk(v));
  }
  return boxes;
}

// Within its box, the number of the connected piece of a bone at each of its voxels; -1 elsewhere.
Image<int32_t> PiecesOf(const LabelMap& labels, int label, const VoxelBox& box) {
  return LabelComponents(MaskOfLabel(Cropped(labels, box), label)).piece;
}

std::vector<Block> PartsOf(const BoneTissue& tissue, const Image<int32_t>& pieces, const CubicImage& scan,
                           const RigidTransform& pose) {
  std::map<std::array<int, 3>, Block> blocks;
  std::map<int32_t, Block> blocks_of_piece;
  for (const TissueSample& sample : tissue.samples) {
    if (sample.own_weight < kOwn) continue;
    const PointMm in_template{tissue.centre.lps + sample.from_centre_mm};
    double value;
    Eigen::Vector3d gradient;
    if (!scan.At(scan.grid().ToVox(pose * in_template).ijk, value, gradient)) continue;
    const Eigen::Array3i cell = (sample.from_centre_mm / kBlockMm).array().round().cast<int>();
    blocks[{cell.x(), cell.y(), cell.z()}].Add(value, sample);
    const Eigen::Vector3i at = pieces.grid.ToVox(in_template).ijk.array().round().cast<int>();
    const int32_t piece = pieces.grid.Contains(at) ? pieces(at.x(), at.y(), at.z()) : -1;
    if (piece >= 0) blocks_of_piece[piece].Add(value, sample);
  }
  std::vector<Block> large;
  const auto keep = [&](const Block& block) {
    if (size_t(block.all.weight()) >= kFewestVoxels) large.push_back(block);
  };
  for (const auto& [cell, block] : blocks) keep(block);
  for (const auto& [piece, block] : blocks_of_piece) keep(block);
  return large;
}

bool HasUnlikePart(const BoneTissue& tissue, const Image<int32_t>& pieces, const CubicImage& scan,
                   const RigidTransform& pose) {
  const std::vector<Block> blocks = PartsOf(tissue, pieces, scan, pose);
  double most_varied = 0, best = -1, least = 1;
  for (const Block& block : blocks) most_varied = std::max(most_varied, block.all.VarianceOfSecond());
  for (const Block& block : blocks) {
    if (block.all.VarianceOfSecond() < kStructure * most_varied) continue;
    best = std::max(best, block.Value()), least = std::min(least, block.Value());
  }
  return least < kUnlike && best > kAlike;
}

}  // namespace

void NameUnlikeParts(const BoneSet& bones, std::span<const BoneTissue> tissue, const CubicImage& scan,
                     BoneFits& fits) {
  const std::vector<VoxelBox> boxes = BoxesOf(bones);
  ParallelFor(fits.size(), [&](size_t b) {
    if (fits[b].Doubtful()) return;
    const Image<int32_t> pieces = PiecesOf(bones.labels, bones.bones[b].label, boxes[b]);
    if (!HasUnlikePart(tissue[b], pieces, scan, fits[b].scan_from_template)) return;
    DoubtBone(
        fits[b],
        "a part of the bone does not match the scan where the rest does, as where two bones have one label "
        "or the scan is spoilt there");
  });
}

}  // namespace kvx
