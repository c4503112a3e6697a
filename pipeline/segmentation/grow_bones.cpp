// Voxels that several bones claim go to the one that leans most. Bones in MR are looked for in several ways,
// small ones in more, and of their surfaces the one that the picture shows best is taken and then placed
// between the voxels.
#include "pipeline/segmentation/grow_bones.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <ranges>
#include <set>

#include "core/axes_order.h"
#include "core/errors.h"
#include "core/parallel.h"
#include "core/quantile.h"
#include "pipeline/scans/grey_kind.h"
#include "pipeline/segmentation/ct/ct_bones.h"
#include "pipeline/segmentation/ct/part_bones.h"
#include "pipeline/segmentation/finish_bone.h"
#include "pipeline/segmentation/mr/bone_in_pieces.h"
#include "pipeline/segmentation/mr/clearest_bone.h"
#include "pipeline/segmentation/mr/farther.h"
#include "pipeline/segmentation/mr/noisy_scan.h"
#include "pipeline/segmentation/mr/outward_rise.h"
#include "pipeline/segmentation/mr/place_shells.h"
#include "pipeline/segmentation/mr/stroke_levels.h"
#include "pipeline/segmentation/mr/stroke_search.h"

namespace kvx {
namespace {

constexpr double kSmall = 60, kTiny = 30;  // diagonal of the strokes' box, in voxels
constexpr double kDoubtfulRise = 0.06;
constexpr double kUnclear = 0.62;    // rise that is doubtful, to the scan's usual
constexpr size_t kFewBones = 4;      // what is usual is not known of fewer
constexpr double kClearEnd = 0.5;    // rise over an end that no stroke came near, to that over the bone
constexpr double kClearPiece = 0.6;  // the same, over a piece with hardly a stroke, to the scan's usual
constexpr double kLeastRise = 0.09;  // over such a piece, where the scan's bones are few and leak
constexpr int kAroundVoxels = 4;     // of a bone that its surface's place depends on

std::vector<StrokeBox> StrokeBoxes(const LabelMap& strokes) {
  std::vector<StrokeBox> list;
  for (const auto& [label, box] : BoxesOf(strokes))
    if (label != kBackgroundStroke) list.push_back({label, box});
  return list;
}

bool IsSmallerThan(double voxels, const StrokeBox& box, const Grid& grid) {
  return DiagonalMm(box.box, grid) < voxels * grid.MeanSpacingMm();
}

std::vector<StrokeBox> SmallerThan(double voxels, const std::vector<StrokeBox>& boxes, const Grid& grid) {
  std::vector<StrokeBox> small;
  std::ranges::copy_if(boxes, std::back_inserter(small),
                       [&](const StrokeBox& box) { return IsSmallerThan(voxels, box, grid); });
  return small;
}

// Labels of which a stroke says otherwise: that it is there, or is not.
std::set<int> Contradicted(const LabelMap& strokes, const LabelMap& previous) {
  std::set<int> contradicted;
  for (size_t v = 0; v < strokes.values.size(); ++v) {
    if (strokes.values[v] == 0 || strokes.values[v] == previous.values[v]) continue;
    contradicted.insert(strokes.values[v]);
    contradicted.insert(previous.values[v]);
  }
  return contradicted;
}

bool HasBones(const LabelMap& labels) {
  return std::ranges::any_of(labels.values, [](uint16_t label) { return label != 0; });
}

class Grower {
 public:
  Grower(const Volume& scan, const LabelMap& strokes, bool ct, const Progress& progress,
         const LabelMap* previous)
      : scan_(scan), strokes_(strokes), ct_(ct), progress_(progress), out_{LabelMap(scan.grid), {}} {
    boxes_ = StrokeBoxes(strokes);
    if (boxes_.empty() && !(previous && HasBones(*previous)))
      throw InputError("the strokes mark no bone; bones are 1, 2, ... and 255 is the background");
    if (previous) Keep(*previous);
    if (!ct && !boxes_.empty()) {
      marrow_ = MarrowLevels(scan, strokes);
      air_ = AirBeside(scan, marrow_);
      calm_.emplace(CalmScan(scan, strokes, marrow_));
    }
  }

  GrownBones Run() {
    if (boxes_.empty()) return std::move(out_);
    if (ct_) {
      bones_ = FindCtBones(scan_, strokes_, boxes_, progress_);
    } else {
      candidates_ =
          CutBonesFromStrokes(scan_, strokes_, air_, boxes_, {.shell = true}, progress_.Part(0.0, 0.6));
      TryAgain(kSmall, {.tight = true}, progress_.Part(0.6, 0.75));
      TryAgain(kTiny, {.tight = true, .fine = true}, progress_.Part(0.75, 0.85));
      TakeClearest();
      AddEnds(progress_.Part(0.85, 0.93));
      AddPieces();
      DoubtUnclear();
      PlaceAllShells();
    }
    Join();
    if (ct_) Part();
    Finish();
    return std::move(out_);
  }

 private:
  // Only a bone that is contradicted and has strokes is looked for again: without any it would be lost.
  void Keep(const LabelMap& previous) {
    const std::set<int> contradicted = Contradicted(strokes_, previous);
    std::erase_if(boxes_, [&](const StrokeBox& box) { return !contradicted.contains(box.label); });
    std::set<int> sought, bitten;
    for (const StrokeBox& box : boxes_) sought.insert(box.label);
    for (size_t v = 0; v < previous.values.size(); ++v) {
      const int label = previous.values[v], stroke = strokes_.values[v];
      if (label == 0 || sought.contains(label)) continue;
      if (stroke == 0 || stroke == label)
        out_.labels.values[v] = uint16_t(label);
      else
        bitten.insert(label);
    }
    for (const int label : bitten)
      Warn(label,
           "strokes mark something else in it and none mark it, so it lost the marked voxels and kept the "
           "others; give its own strokes as well to have it looked for again");
  }

  bool IsSmall(int label) const {
    return IsSmallerThan(kSmall, *std::ranges::find(boxes_, label, &StrokeBox::label), scan_.grid);
  }

  double RiseOf(const FoundBone& bone) const {
    return OutwardRise(**calm_, marrow_.at(bone.label), bone.box, bone.mask);
  }

  std::vector<double> Rises() const {
    std::vector<double> rises;
    for (const FoundBone& bone : bones_) rises.push_back(RiseOf(bone));
    return rises;
  }

  void TryAgain(double smaller_than, const StrokeSearch& search, const Progress& progress) {
    const std::vector<StrokeBox> small = SmallerThan(smaller_than, boxes_, scan_.grid);
    if (small.empty()) return;
    for (std::vector<FoundBone>& again :
         CutBonesFromStrokes(scan_, strokes_, air_, small, search, progress)) {
      const int label = again.front().label;
      auto& candidates =
          *std::ranges::find_if(candidates_, [&](const auto& c) { return c.front().label == label; });
      std::ranges::move(again, std::back_inserter(candidates));
    }
  }

  void TakeClearest() {
    bones_.resize(candidates_.size());
    ParallelFor(bones_.size(), [&](size_t b) {
      std::vector<FoundBone>& candidates = candidates_[b];
      const double marrow = marrow_.at(candidates.front().label);
      bones_[b] = std::move(candidates[ClearestBone(**calm_, marrow, candidates)]);
    });
    candidates_.clear();
  }

  // An end is as clear as the bone and the scan's other bones are.
  void AddEnds(const Progress& progress) {
    const std::vector<double> rises = Rises();
    std::vector<double> ranked = rises;
    const double usual = TakeMedian(ranked);
    const auto farther =
        CutBonesFromStrokes(scan_, strokes_, air_, boxes_, {.far = true, .shell = true}, progress);
    ParallelFor(bones_.size(), [&](size_t b) {
      const double clear_rise = kClearEnd * std::max(rises[b], usual);
      const double marrow = marrow_.at(bones_[b].label);
      // The answer with a shell leaks less, so it is heard first; the other reaches farther.
      for (const FoundBone& more : std::views::reverse(farther[b]))
        bones_[b] = WithEnds(bones_[b], more, **calm_, marrow, clear_rise);
    });
  }

  LabelMap Found() const {
    LabelMap found = out_.labels;
    for (const FoundBone& bone : bones_) {
      ForEachVoxel(bone.box, scan_.grid, [&](const auto&, size_t part, size_t whole) {
        if (bone.mask.values[part]) found.values[whole] = uint16_t(bone.label);
      });
    }
    return found;
  }

  // Beside pieces that were added there may be more.
  void AddPieces() {
    constexpr int kRounds = 2;
    std::vector<double> rises = Rises();
    const double clear_rise = std::max(kLeastRise, kClearPiece * TakeMedian(rises));
    std::vector<uint8_t> changes(bones_.size(), 1);
    std::vector<int> unmarked(bones_.size());
    for (int round = 0; round < kRounds; ++round) {
      const LabelMap found = Found();
      ParallelFor(bones_.size(), [&](size_t b) {
        if (!changes[b]) return;
        const double marrow = marrow_.at(bones_[b].label);
        auto [answers, pieces] =
            AnswersInPieces({scan_, **calm_, strokes_, air_}, bones_[b], found, marrow, clear_rise);
        const size_t before = answers.size();
        answers.push_back(std::move(bones_[b]));
        const size_t clearest = ClearestBone(**calm_, marrow, answers);
        changes[b] = clearest != before;
        if (changes[b]) unmarked[b] += pieces;
        bones_[b] = std::move(answers[clearest]);
      });
    }
    for (size_t b = 0; b < bones_.size(); ++b) {
      if (unmarked[b] == 0) continue;
      std::string doubt = "it is in pieces, and beside those that strokes mark some were taken for it (";
      doubt += std::to_string(unmarked[b]);
      doubt += "); look at them, and mark as background what is none of it";
      Warn(bones_[b].label, doubt);
    }
  }

  // Surfaces over fat and muscle have some rise, too; of a bone that is found right never so little.
  void DoubtUnclear() {
    const std::vector<double> rises = Rises();
    std::vector<double> ranked = rises;
    const double least = rises.size() < kFewBones ? 0 : kUnclear * TakeMedian(ranked);
    for (size_t b = 0; b < rises.size(); ++b) {
      const int label = bones_[b].label;
      if (IsSmall(label) && rises[b] < kDoubtfulRise) {
        Warn(label,
             "hardly any dark cortex lies under the surface that was found; check it, and draw "
             "more strokes in it and around it");
      } else if (rises[b] < least) {
        Warn(label,
             "far less dark cortex lies under its surface than under those of other bones; check whether "
             "other tissue is in it or a part of it is missing, and draw more strokes in it and around it");
      }
    }
  }

  // The bone and a little around it, on the box's grid.
  VoxelBox PartOf(const FoundBone& bone) const {
    return BoxOf(bone.mask).Grown(Eigen::Vector3i::Constant(kAroundVoxels), bone.mask.grid);
  }

  RoughBone Rough(const FoundBone& bone) const {
    const VoxelBox part = PartOf(bone);
    RoughBone rough{Cropped(scan_, {part.low + bone.box.low, part.high + bone.box.low}),
                    Cropped(bone.mask, part), Cropped(bone.marrow, part)};
    const double marrow = marrow_.at(bone.label);
    for (float& r : rough.relative.values) r = float(r / marrow);
    rough.small = IsSmall(bone.label);
    return rough;
  }

  void PlaceAllShells() {
    std::vector<RoughBone> rough(bones_.size());
    ParallelFor(bones_.size(), [&](size_t b) { rough[b] = Rough(bones_[b]); });
    const std::vector<PlacedShell> shells = PlaceShells(rough);
    for (size_t b = 0; b < shells.size(); ++b) Place(shells[b], bones_[b]);
  }

  void Place(const PlacedShell& shell, FoundBone& bone) const {
    const VoxelBox part = PartOf(bone);
    ForEachVoxel(part, bone.mask.grid, [&](const auto& p, size_t at, size_t in_box) {
      const Eigen::Vector3i v = p + part.low + bone.box.low;
      const int stroke = strokes_(v.x(), v.y(), v.z());
      bone.mask.values[in_box] = shell.mask.values[at] && (stroke == 0 || stroke == bone.label);
    });
  }

  // What is kept is no longer to be had.
  void Join() {
    Image<float> best(scan_.grid, -INFINITY);
    for (size_t v = 0; v < best.values.size(); ++v) {
      if (out_.labels.values[v] != 0) best.values[v] = INFINITY;
    }
    for (const FoundBone& bone : bones_) {
      ForEachVoxel(bone.box, scan_.grid, [&](const auto&, size_t part, size_t whole) {
        if (!bone.mask.values[part] || bone.lean.values[part] <= best.values[whole]) return;
        best.values[whole] = bone.lean.values[part];
        out_.labels.values[whole] = uint16_t(bone.label);
      });
    }
  }

  // What is kept takes no part. Of each bone only label and box are needed from here on.
  void Part() {
    std::set<int> sought;
    for (FoundBone& bone : bones_) {
      sought.insert(bone.label);
      bone.mask = {}, bone.lean = {};
    }
    LabelMap found = out_.labels;
    for (uint16_t& label : found.values) label = sought.contains(label) ? label : 0;
    found = PartedBones(scan_, strokes_, std::move(found));
    for (size_t v = 0; v < found.values.size(); ++v) {
      if (found.values[v] != 0) out_.labels.values[v] = found.values[v];
    }
  }

  void Finish() {
    std::vector<BoneFinish> finishes(bones_.size());
    ParallelFor(bones_.size(), [&](size_t b) {
      finishes[b] = FinishBone(out_.labels, strokes_, bones_[b].label, bones_[b].box, !ct_);
    });
    for (size_t b = 0; b < bones_.size(); ++b) {
      Put(finishes[b], bones_[b]);
      for (const std::string& doubt : finishes[b].doubts) Warn(bones_[b].label, doubt);
      if (bones_[b].reaches_box)
        Warn(bones_[b].label, "it goes far beyond its strokes; mark the background around it");
    }
  }

  // What another bone took meanwhile stays there.
  void Put(const BoneFinish& finish, const FoundBone& bone) {
    ForEachVoxel(bone.box, scan_.grid, [&](const auto&, size_t part, size_t whole) {
      uint16_t& value = out_.labels.values[whole];
      if (value == bone.label && !finish.mask.values[part]) value = 0;
      if (value == 0 && finish.mask.values[part]) value = uint16_t(bone.label);
    });
  }

  void Warn(int label, const std::string& doubt) {
    out_.warnings.push_back("bone " + std::to_string(label) + ": " + doubt);
  }

  const Volume& scan_;
  const LabelMap& strokes_;
  const bool ct_;
  const Progress& progress_;
  GrownBones out_;
  std::map<int, double> marrow_;                    // MR only
  LabelMap air_;                                    // MR only: 1 in air
  std::optional<OwnOrLent<Volume>> calm_;           // MR only: what surfaces are judged by
  std::vector<StrokeBox> boxes_;                    // of the bones to be found
  std::vector<std::vector<FoundBone>> candidates_;  // MR only, bone by bone
  std::vector<FoundBone> bones_;
};

}  // namespace

// How neighbours are gone through decides between voxels that are as good. In MR, where there are many, they
// are gone through in one order however the scan is stored. Marrow and cortex are told apart by parts of the
// way up from no signal.
GrownBones GrowBones(const Volume& scan, const LabelMap& strokes, bool ct, const Progress& progress,
                     const LabelMap* previous) {
  const Grid order = RightFrontUp(scan.grid);
  if (ct || (order == scan.grid && ZeroLevelOf(scan) == 0))
    return Grower(scan, strokes, ct, progress, previous).Run();
  Volume from_zero = InOrderOf(order, scan);
  const float zero = float(ZeroLevelOf(from_zero));
  for (float& value : from_zero.values) value -= zero;
  const LabelMap marks = InOrderOf(order, strokes),
                 before = previous ? InOrderOf(order, *previous) : LabelMap();
  GrownBones grown = Grower(from_zero, marks, false, progress, previous ? &before : nullptr).Run();
  grown.labels = InOrderOf(scan.grid, grown.labels);
  return grown;
}

}  // namespace kvx
