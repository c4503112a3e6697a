// Bones are independent but for their colours and for voxels that several claim; those go to the one that
// leans most.
#include "pipeline/segmentation/grow_bones.h"

#include <cmath>
#include <map>
#include <memory>

#include "core/errors.h"
#include "core/parallel.h"
#include "pipeline/segmentation/cortex.h"
#include "pipeline/segmentation/finish_bone.h"

namespace kvx {
namespace {

constexpr double kMarginMm = 10, kMarginOfDiagonal = 0.25;
constexpr int kRounds = 2;
constexpr int kMostGrowth = 3;

using Bones = std::vector<std::unique_ptr<StrokeBone>>;

std::map<int, VoxelBox> StrokeBoxes(const LabelMap& strokes) {
  std::map<int, VoxelBox> boxes;
  for (size_t v = 0; v < strokes.values.size(); ++v) {
    const int label = strokes.values[v];
    if (label != 0 && label != kBackgroundStroke) boxes[label].Include(strokes.grid.Ijk(v));
  }
  if (boxes.empty())
    throw InputError("the strokes mark no bone; bones are 1, 2, ... and 255 is the background");
  return boxes;
}

VoxelBox WithMargin(const VoxelBox& box, const Grid& grid) {
  const double diagonal_mm = box.size().cast<double>().cwiseProduct(grid.spacing_mm).norm();
  const double margin_mm = std::max(kMarginMm, kMarginOfDiagonal * diagonal_mm);
  return box.Grown((margin_mm * grid.spacing_mm.cwiseInverse()).array().ceil().cast<int>().matrix(), grid);
}

TissueCounts CountAll(const Bones& bones) {
  TissueCounts all;
  for (const auto& bone : bones) all.Add(bone->Count());
  return all;
}

// Each voxel goes to the bone that claims it; of several, to the one that leans most (of equals, the first).
LabelMap Joined(const Bones& bones, const std::vector<Mask>& masks, const Grid& grid) {
  LabelMap labels(grid);
  Image<float> best(grid, -INFINITY);
  for (size_t b = 0; b < bones.size(); ++b) {
    ForEachVoxel(bones[b]->box(), grid, [&](const auto&, size_t part, size_t whole) {
      const float lean = bones[b]->own_strokes().values[part] ? INFINITY : bones[b]->lean().values[part];
      if (!masks[b].values[part] || lean <= best.values[whole]) return;
      best.values[whole] = lean;
      labels.values[whole] = uint16_t(bones[b]->label());
    });
  }
  return labels;
}

class Grower {
 public:
  Grower(const Volume& scan, const LabelMap& strokes, bool ct, const Progress& progress)
      : scan_(scan), strokes_(strokes), ct_(ct), progress_(progress) {}

  GrownBones Run() {
    Prepare();
    for (int round = 0; round < kRounds; ++round) CutAll(round + 1 == kRounds);
    const TissueCounts tissues = CountAll(bones_);
    std::vector<Mask> masks(bones_.size());
    ParallelFor(bones_.size(),
                [&](size_t b) { masks[b] = ct_ ? bones_[b]->found() : WithCortex(*bones_[b], tissues); });
    progress_.Report("segment", 0.9);
    GrownBones out{Joined(bones_, masks, scan_.grid), {}};
    Finish(out);
    return out;
  }

 private:
  void Prepare() {
    std::vector<std::pair<int, VoxelBox>> boxes;
    for (const auto& [label, box] : StrokeBoxes(strokes_))
      boxes.emplace_back(label, WithMargin(box, scan_.grid));
    bones_.resize(boxes.size());
    ParallelFor(boxes.size(), [&](size_t b) {
      bones_[b] = std::make_unique<StrokeBone>(scan_, strokes_, boxes[b].first, boxes[b].second, ct_);
    });
    progress_.Report("segment", 0.5);
  }

  void CutAll(bool last) {
    const TissueCounts tissues = CountAll(bones_);
    ParallelFor(bones_.size(), [&](size_t b) {
      CutInBox(bones_[b], tissues);
      if (!last) bones_[b]->Reconsider();
    });
    progress_.Report("segment", last ? 0.8 : 0.65);
  }

  // A bone that reaches the side of its box is looked for again in a larger one.
  void CutInBox(std::unique_ptr<StrokeBone>& bone, const TissueCounts& tissues) {
    bone->Cut(tissues);
    for (int growth = 0; growth < kMostGrowth && bone->ReachesBox(); ++growth) {
      bone = std::make_unique<StrokeBone>(scan_, strokes_, bone->label(), WithMargin(bone->box(), scan_.grid),
                                          ct_);
      bone->Cut(tissues);
    }
  }

  void Finish(GrownBones& out) {
    std::vector<BoneFinish> finishes(bones_.size());
    ParallelFor(bones_.size(), [&](size_t b) {
      finishes[b] = FinishBone(out.labels, strokes_, bones_[b]->label(), bones_[b]->box());
    });
    for (size_t b = 0; b < bones_.size(); ++b) {
      Put(finishes[b], *bones_[b], out.labels);
      for (const std::string& doubt : finishes[b].doubts) {
        out.warnings.push_back("bone " + std::to_string(bones_[b]->label()) + ": " + doubt);
      }
      if (bones_[b]->ReachesBox()) {
        out.warnings.push_back("bone " + std::to_string(bones_[b]->label()) +
                               ": it goes far beyond its strokes; mark the background around it");
      }
    }
  }

  // What another bone took meanwhile stays there.
  static void Put(const BoneFinish& finish, const StrokeBone& bone, LabelMap& labels) {
    ForEachVoxel(bone.box(), labels.grid, [&](const auto&, size_t part, size_t whole) {
      uint16_t& value = labels.values[whole];
      if (value == bone.label() && !finish.mask.values[part]) value = 0;
      if (value == 0 && finish.mask.values[part]) value = uint16_t(bone.label());
    });
  }

  const Volume& scan_;
  const LabelMap& strokes_;
  bool ct_;
  const Progress& progress_;
  Bones bones_;
};

}  // namespace

GrownBones GrowBones(const Volume& scan, const LabelMap& strokes, bool ct, const Progress& progress) {
  return Grower(scan, strokes, ct, progress).Run();
}

}  // namespace kvx
