// Geodesic distances that pay for falls away from a bone and for rises into one give each voxel its lean; a
// minimum cut gives the border. A large bone is found on larger voxels first, and its border then on smaller
// and smaller ones.
#include "pipeline/segmentation/ct/ct_bones.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>

#include "core/host/parallel.h"
#include "pipeline/scans/coarser.h"
#include "pipeline/segmentation/ct/ct_border.h"
#include "pipeline/segmentation/ct/ct_lean.h"
#include "pipeline/segmentation/ct/ct_outside.h"
#include "pipeline/segmentation/ct/finer_border.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"
#include "pipeline/segmentation/strokes/stroke_remoteness.h"

namespace kvx {
namespace {

constexpr double kMarginMm = 10, kMarginOfDiagonal = 0.35;
constexpr int kMostGrowth = 2;
constexpr float kOutsideHandicap = 2;  // the outside's marks are many and near, a bone's few
constexpr float kRemoteLean = 0.2f;    // how much of a bone's lean may be lost far from its strokes
constexpr size_t kMostVoxels = 2'000'000, kMostOfScan = 12'000'000;  // at once; more are taken in blocks

VoxelBox WithMargin(const VoxelBox& box, const Grid& grid) {
  return GrownByMm(box, std::max(kMarginMm, kMarginOfDiagonal * DiagonalMm(box, grid)), grid);
}

// Where the box ends and the scan goes on. `p`: in blocks.
bool OnInnerSide(const Eigen::Vector3i& p, const BlockedBox& part, const Grid& scan) {
  const Eigen::Vector3i size = part.size();
  for (int axis = 0; axis < 3; ++axis) {
    if (p[axis] == 0 && part.box.low[axis] > 0) return true;
    if (p[axis] + 1 == size[axis] && part.box.high[axis] < scan.size[axis]) return true;
  }
  return false;
}

// What is outside of bones by itself, on blocks of a whole scan.
struct ScanOutside {
  BlockedBox scan;
  Mask outside;

  explicit ScanOutside(const Volume& scan_hu) {
    const VoxelBox all{Eigen::Vector3i::Zero(), scan_hu.grid.size};
    scan = {all, BlocksFor(all, scan_hu.grid, kMostOfScan).back()};
    outside = OutsideOfBones(Coarser(scan_hu, scan));
  }
  bool At(const Eigen::Vector3i& voxel) const {
    const Eigen::Vector3i p = voxel.cwiseQuotient(scan.block);
    return outside(p.x(), p.y(), p.z()) != 0;
  }
};

class CtBone {
 public:
  CtBone(const Volume& scan_hu, const LabelMap& strokes, const ScanOutside& outside, const StrokeBox& bone,
         const BlockedBox& part, double scan_noise_hu)
      : bone_(bone),
        part_(part),
        scan_grid_(scan_hu.grid),
        diagonal_mm_(DiagonalMm(bone.box, scan_hu.grid)),
        marks_(Coarser(strokes, part, bone.label)),
        outside_(marks_.grid) {
    Volume hu = Coarser(scan_hu, part);
    noise_hu_ = part.block == Eigen::Vector3i::Ones() ? scan_noise_hu : NoiseHu(hu);
    density_ = DensityOf(std::move(hu));
    for (size_t v = 0; v < marks_.values.size(); ++v) {
      const uint16_t mark = marks_.values[v];
      outside_.values[v] =
          mark != 0 ? mark == kBackgroundStroke : outside.At(part.VoxelOf(marks_.grid.Ijk(v)));
    }
  }

  FoundBone Find() const {
    FoundBone found{bone_.label, part_.box, {}, Lean(), false};
    found.mask = CtBorder(density_, found.lean, Sides(), noise_hu_);
    for (size_t v = 0; v < found.mask.values.size(); ++v) {
      if (Own(v)) found.lean.values[v] = INFINITY;
      found.reaches_box |= found.mask.values[v] && OnInnerSide(density_.grid.Ijk(v), part_, scan_grid_);
    }
    return found;
  }

 private:
  bool Own(size_t v) const { return marks_.values[v] == bone_.label; }
  bool OtherBone(size_t v) const { return IsOfBone(marks_.values[v]) && !Own(v); }

  template <class Is>
  Mask Where(Is&& is) const {
    Mask mask(marks_.grid);
    for (size_t v = 0; v < mask.values.size(); ++v) mask.values[v] = is(v);
    return mask;
  }

  // What others cost is bounded: no way within a bone costs more than a diagonal of its strokes.
  Image<float> Lean() const {
    const CtWays ways{density_, noise_hu_, diagonal_mm_};
    const float most_mm = float(diagonal_mm_);
    const Mask strokes = Where([&](size_t v) { return Own(v); });
    const Image<float> own = ways.PayingFalls(strokes, 3 * diagonal_mm_);
    const Image<float> others = ways.PayingFalls(Where([&](size_t v) { return OtherBone(v); }), diagonal_mm_);
    const Image<float> outside = ways.PayingRises(outside_, diagonal_mm_ / kOutsideHandicap);
    Image<float> lean = RemotenessFromLines(strokes);
    for (size_t v = 0; v < lean.values.size(); ++v) {
      const float other = std::min({others.values[v], kOutsideHandicap * outside.values[v], most_mm});
      const float remote = std::clamp(1.2f * (lean.values[v] - 1), 0.0f, 1.0f);
      lean.values[v] = LeanOf(own.values[v], other) - kRemoteLean * remote;
    }
    return lean;
  }

  Image<Side> Sides() const {
    Image<Side> sides(density_.grid, Side::kFree);
    for (size_t v = 0; v < sides.values.size(); ++v) {
      if (outside_.values[v] || OtherBone(v)) sides.values[v] = Side::kOutside;
      if (Own(v)) sides.values[v] = Side::kInside;
    }
    return sides;
  }

  const StrokeBox& bone_;
  const BlockedBox part_;
  const Grid& scan_grid_;
  const double diagonal_mm_;
  const LabelMap marks_;
  Mask outside_;  // by strokes, or by itself where no stroke says otherwise
  double noise_hu_;
  Volume density_;
};

class CtSearch {
 public:
  using Report = std::function<void(double)>;  // what was done of a bone since the last time

  CtSearch(const Volume& scan_hu, const LabelMap& strokes)
      : scan_hu_(scan_hu), strokes_(strokes), outside_(scan_hu), noise_hu_(NoiseHu(scan_hu)) {}

  FoundBone Find(const StrokeBox& bone, const Report& report) const {
    FoundBone found;
    VoxelBox box = bone.box;
    std::vector<Eigen::Vector3i> blocks;
    for (int growth = 0; growth == 0 || (growth <= kMostGrowth && found.reaches_box); ++growth) {
      box = WithMargin(box, scan_hu_.grid);
      blocks = BlocksFor(box, scan_hu_.grid, kMostVoxels);
      found = CtBone(scan_hu_, strokes_, outside_, bone, {box, blocks.back()}, noise_hu_).Find();
      report(growth == 0 ? 0.5 : 0.0);
    }
    const FinerBorder finer{scan_hu_, strokes_, DiagonalMm(bone.box, scan_hu_.grid),
                            found.mask.grid.MeanSpacingMm()};
    for (size_t level = blocks.size() - 1; level > 0; --level) {
      found = finer.Of(found, blocks[level], blocks[level - 1]);
      report(0.0);
    }
    report(0.5);
    return found;
  }

 private:
  const Volume& scan_hu_;
  const LabelMap& strokes_;
  const ScanOutside outside_;
  const double noise_hu_;
};

}  // namespace

std::vector<FoundBone> FindCtBones(const Volume& scan_hu, const LabelMap& strokes,
                                   const std::vector<StrokeBox>& boxes, const Progress& progress) {
  progress.Report("segment", 0.05);
  const CtSearch search(scan_hu, strokes);
  std::vector<FoundBone> found(boxes.size());
  std::mutex reporting;
  double done = 0;
  const auto report = [&](double more) {
    const std::lock_guard lock(reporting);
    done += more;
    progress.Report("segment", 0.2 + 0.8 * done / double(boxes.size()));
  };
  ParallelFor(boxes.size(), [&](size_t b) { found[b] = search.Find(boxes[b], report); });
  return found;
}

}  // namespace kvx
