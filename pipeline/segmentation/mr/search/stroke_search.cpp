// Cuts alternate with new colours and levels, read from what the cuts found.
#include "pipeline/segmentation/mr/search/stroke_search.h"

#include <cmath>
#include <memory>

#include "core/host/parallel.h"
#include "pipeline/segmentation/mr/search/cortex.h"
#include "pipeline/segmentation/mr/search/refined.h"

namespace kvx {
namespace {

constexpr double kMarginMm = 10, kMarginOfDiagonal = 0.25;
constexpr double kLongMarginOfDiagonal = 0.5;
constexpr int kRounds = 2;
constexpr int kMostGrowth = 3;

// What lies beyond a box counts as elsewhere, so a bone ends well before its sides.
VoxelBox WithMargin(const VoxelBox& box, const Grid& grid, bool far) {
  const double diagonal_mm = DiagonalMm(box, grid);
  const double of_diagonal = far && diagonal_mm > kLongMm ? kLongMarginOfDiagonal : kMarginOfDiagonal;
  return GrownByMm(box, std::max(kMarginMm, of_diagonal * diagonal_mm), grid);
}

class Search {
 public:
  Search(const Volume& scan, const LabelMap& strokes, const LabelMap& air,
         const std::vector<StrokeBox>& boxes, const StrokeSearch& how, const Progress& progress)
      : scan_(scan), strokes_(strokes), air_(air), how_(how), progress_(progress), bones_(boxes.size()) {
    ParallelFor(boxes.size(), [&](size_t b) {
      bones_[b] = Prepared(boxes[b].label, WithMargin(boxes[b].box, scan.grid, how.far));
    });
    progress_.Report("segment", 0.5);
  }

  std::vector<std::vector<FoundBone>> Run() {
    for (int round = 0; round < kRounds; ++round) CutAll(round + 1 == kRounds);
    const TissueCounts tissues = CountAll();
    std::vector<std::vector<FoundBone>> found(bones_.size());
    ParallelFor(bones_.size(), [&](size_t b) {
      found[b].push_back(OnVoxelsOf(*bones_[b], tissues));
      if (!how_.shell) return;
      CutWithShellInBox(bones_[b], tissues);
      found[b].push_back(OnVoxelsOf(*bones_[b], tissues));
    });
    progress_.Report("segment", 1.0);
    return found;
  }

 private:
  std::unique_ptr<StrokeBone> Prepared(int label, const VoxelBox& box) const {
    return std::make_unique<StrokeBone>(scan_, strokes_, air_, label, box, how_);
  }

  TissueCounts CountAll() const {
    TissueCounts all;
    for (const auto& bone : bones_) all.Add(bone->Count());
    return all;
  }

  void CutAll(bool last) {
    const TissueCounts tissues = CountAll();
    ParallelFor(bones_.size(), [&](size_t b) {
      CutInBox(bones_[b], tissues);
      if (!last) bones_[b]->Reconsider();
    });
    progress_.Report("segment", last ? 0.9 : 0.7);
  }

  void CutInBox(std::unique_ptr<StrokeBone>& bone, const TissueCounts& tissues) const {
    bone->Cut(tissues);
    LookInLargerBoxes(bone, tissues, [](const StrokeBone&) { return true; });
  }

  // Of two answers the larger counts: far from its strokes a larger box may find less.
  void CutWithShellInBox(std::unique_ptr<StrokeBone>& bone, const TissueCounts& tissues) const {
    bone->CutWithShell(tissues);
    LookInLargerBoxes(bone, tissues, [&](StrokeBone& larger) {
      larger.Reconsider();
      larger.CutWithShell(tissues);
      return larger.Voxels() > bone->Voxels();
    });
  }

  // A bone that reaches the side of its box is looked for again in a larger one, as long as counts(what was
  // found there) holds; what a farther search finds there is rather no bone.
  template <class Counts>
  void LookInLargerBoxes(std::unique_ptr<StrokeBone>& bone, const TissueCounts& tissues,
                         const Counts& counts) const {
    const int most_growth = how_.far ? 0 : kMostGrowth;
    for (int growth = 0; growth < most_growth && bone->ReachesBox(); ++growth) {
      std::unique_ptr<StrokeBone> larger =
          Prepared(bone->label(), WithMargin(bone->box(), scan_.grid, how_.far));
      larger->Cut(tissues);
      if (!counts(*larger)) return;
      bone = std::move(larger);
    }
  }

  FoundBone OnVoxelsOf(const StrokeBone& bone, const TissueCounts& tissues) const {
    FoundBone found{bone.label(), bone.box(),        WithCortex(bone, tissues),
                    bone.lean(),  bone.ReachesBox(), bone.Marrow()};
    for (size_t v = 0; v < found.lean.values.size(); ++v) {
      if (bone.own_strokes().values[v]) found.lean.values[v] = INFINITY;
    }
    if (!how_.fine) return found;
    const Grid voxels = GridOf(bone.box(), scan_.grid);
    found.mask = OnVoxels(found.mask, voxels);
    found.marrow = OnVoxels(found.marrow, voxels);
    found.lean = OnVoxels(found.lean, voxels);
    return found;
  }

  const Volume& scan_;
  const LabelMap& strokes_;
  const LabelMap& air_;
  const StrokeSearch how_;
  const Progress& progress_;
  std::vector<std::unique_ptr<StrokeBone>> bones_;
};

}  // namespace

std::vector<std::vector<FoundBone>> CutBonesFromStrokes(const Volume& scan, const LabelMap& strokes,
                                                        const LabelMap& air,
                                                        const std::vector<StrokeBox>& boxes,
                                                        const StrokeSearch& search,
                                                        const Progress& progress) {
  return Search(scan, strokes, air, boxes, search, progress).Run();
}

}  // namespace kvx
