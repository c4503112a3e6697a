// Inside and outside are certain away from the border. Between them, ways from both sides give the lean anew,
// and the one that was found on large voxels has its say: it knows of the strokes.
#include "pipeline/segmentation/ct/finer_border.h"

#include <algorithm>
#include <cmath>

#include "core/voxels/dilated.h"
#include "core/voxels/sample_clamped.h"
#include "pipeline/scans/coarser.h"
#include "pipeline/segmentation/ct/ct_border.h"
#include "pipeline/segmentation/ct/ct_lean.h"

namespace kvx {
namespace {

constexpr int kInwards = 1, kOutwards = 2;  // how far from the found border it may lie, in large voxels
constexpr float kOldLean = 0.6f;

Mask Where(const Image<Side>& sides, Side side) {
  Mask mask(sides.grid);
  for (size_t v = 0; v < mask.values.size(); ++v) mask.values[v] = sides.values[v] == side;
  return mask;
}

Mask Both(Mask a, const Mask& b) {
  for (size_t v = 0; v < a.values.size(); ++v) a.values[v] &= b.values[v];
  return a;
}

// What was found on large voxels, seen from the small ones of the part around it.
class LargeVoxels {
 public:
  LargeVoxels(const FoundBone& found, const Eigen::Vector3i& from, const Eigen::Vector3i& to)
      : lean_(found.lean), from_(from), to_(to), maybe_(found.mask), sure_(found.mask) {
    for (float& lean : lean_.values) lean = std::clamp(lean, -1.0f, 1.0f);  // infinite in strokes
    for (int n = 0; n < kOutwards; ++n) maybe_ = Dilated(maybe_);
    for (int n = 0; n < kInwards; ++n) sure_ = Eroded(sure_);
    const VoxelBox large = BoxOf(maybe_);
    first_ = large.low;
    part_.box.low = found.box.low + first_.cwiseProduct(from);
    part_.box.high = (found.box.low + large.high.cwiseProduct(from)).cwiseMin(found.box.high);
    part_.block = to;
  }

  const BlockedBox& part() const { return part_; }

  Side SideOf(const Eigen::Vector3i& small) const {
    const Eigen::Vector3i p = HolderOf(small);
    if (sure_(p.x(), p.y(), p.z())) return Side::kInside;
    return maybe_(p.x(), p.y(), p.z()) ? Side::kFree : Side::kOutside;
  }
  float Lean(const Eigen::Vector3i& small) const {
    const Eigen::Vector3i p = HolderOf(small);
    return lean_(p.x(), p.y(), p.z());
  }
  float LeanBetween(const Eigen::Vector3i& small) const {
    const Eigen::Array3d from = from_.cast<double>(), to = to_.cast<double>();
    const Eigen::Array3d middle = small.cast<double>().array() * to + (to - from) / 2;
    return SampleClamped(lean_, PointVox{middle / from + first_.cast<double>().array()});
  }

 private:
  Eigen::Vector3i HolderOf(const Eigen::Vector3i& small) const {
    return first_ + small.cwiseProduct(to_).cwiseQuotient(from_);
  }

  Image<float> lean_;
  const Eigen::Vector3i from_, to_;
  Mask maybe_, sure_;
  Eigen::Vector3i first_;  // large voxel of the part
  BlockedBox part_;
};

Image<Side> SidesOf(const LargeVoxels& large, const LabelMap& marks, int label) {
  Image<Side> sides(marks.grid);
  for (size_t v = 0; v < sides.values.size(); ++v) {
    const int mark = marks.values[v];
    sides.values[v] = mark == 0       ? large.SideOf(marks.grid.Ijk(v))
                      : mark == label ? Side::kInside
                                      : Side::kOutside;
  }
  return sides;
}

Image<float> LeanIn(const LargeVoxels& large, const Image<Side>& sides, CtWays ways) {
  const Mask free = Where(sides, Side::kFree), near = Dilated(Dilated(free));
  ways.within = &free;
  const Image<float> own = ways.PayingFalls(Both(near, Where(sides, Side::kInside)), 3 * ways.diagonal_mm);
  const Image<float> other = ways.PayingRises(Both(near, Where(sides, Side::kOutside)), ways.diagonal_mm);
  Image<float> lean(sides.grid);
  for (size_t v = 0; v < lean.values.size(); ++v) {
    const Eigen::Vector3i p = sides.grid.Ijk(v);
    lean.values[v] = large.Lean(p);
    if (sides.values[v] != Side::kFree) continue;
    const float anew = LeanOf(own.values[v], std::min(other.values[v], float(ways.diagonal_mm)));
    lean.values[v] = (1 - kOldLean) * anew + kOldLean * large.LeanBetween(p);
  }
  return lean;
}

}  // namespace

FoundBone FinerBorder::Of(const FoundBone& found, const Eigen::Vector3i& from,
                          const Eigen::Vector3i& to) const {
  const LargeVoxels large(found, from, to);
  const LabelMap marks = Coarser(strokes, large.part(), found.label);
  const Image<Side> sides = SidesOf(large, marks, found.label);
  Volume hu = Coarser(scan_hu, large.part());
  const double noise_hu = NoiseHu(hu);
  const Volume density = DensityOf(std::move(hu));
  FoundBone finer{found.label, large.part().box, {}, {}, found.reaches_box};
  finer.lean = LeanIn(large, sides, {density, noise_hu, diagonal_mm});
  const double detail = density.grid.MeanSpacingMm() / first_mm;
  finer.mask = CtBorder(density, finer.lean, sides, noise_hu, detail);
  for (size_t v = 0; v < marks.values.size(); ++v) {
    if (marks.values[v] == found.label) finer.lean.values[v] = INFINITY;
  }
  return finer;
}

}  // namespace kvx
