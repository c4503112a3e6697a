// Bones are looked for in several ways, small ones in more, and of their surfaces the one that the picture
// shows best is taken and then placed between the voxels.
#include "pipeline/segmentation/mr/mr_bones.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <ranges>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"
#include "pipeline/segmentation/mr/levels/dark_inside.h"
#include "pipeline/segmentation/mr/levels/noisy_scan.h"
#include "pipeline/segmentation/mr/levels/stroke_levels.h"
#include "pipeline/segmentation/mr/search/bone_in_pieces.h"
#include "pipeline/segmentation/mr/search/clearest_bone.h"
#include "pipeline/segmentation/mr/search/farther.h"
#include "pipeline/segmentation/mr/search/stroke_search.h"
#include "pipeline/segmentation/mr/shells/outward_rise.h"
#include "pipeline/segmentation/mr/shells/place_shells.h"

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

bool IsSmallerThan(double voxels, const StrokeBox& box, const Grid& grid) {
  return DiagonalMm(box.box, grid) < voxels * grid.MeanSpacingMm();
}

std::vector<StrokeBox> SmallerThan(double voxels, const std::vector<StrokeBox>& boxes, const Grid& grid) {
  std::vector<StrokeBox> small;
  std::ranges::copy_if(boxes, std::back_inserter(small),
                       [&](const StrokeBox& box) { return IsSmallerThan(voxels, box, grid); });
  return small;
}

// All 26 of each voxel.
Mask WithNeighbours(const LabelMap& voxels) {
  Mask with(voxels.grid);
  for (size_t v = 0; v < with.values.size(); ++v) {
    if (voxels.values[v] == 0) continue;
    const Eigen::Vector3i p = voxels.grid.Ijk(v);
    const VoxelBox around =
        VoxelBox{p, p + Eigen::Vector3i::Ones()}.Grown(Eigen::Vector3i::Ones(), with.grid);
    ForEachVoxel(around, [&](const Eigen::Vector3i& q) { with(q.x(), q.y(), q.z()) = 1; });
  }
  return with;
}

class MrSearch {
 public:
  MrSearch(const Volume& scan, const LabelMap& strokes, const std::vector<StrokeBox>& boxes,
           const LabelMap& kept, const Progress& progress)
      : scan_(scan),
        strokes_(strokes),
        boxes_(boxes),
        kept_(kept),
        progress_(progress),
        marrow_(MarrowLevels(scan, strokes)),
        air_(AirBeside(scan, marrow_)),
        calm_(CalmScan(scan, strokes, marrow_)) {}

  MrBones Run() {
    candidates_ =
        CutBonesFromStrokes(scan_, strokes_, air_, boxes_, {.shell = true}, progress_.Part(0.0, 0.6));
    TryAgain(kSmall, {.tight = true}, progress_.Part(0.6, 0.75));
    TryAgain(kTiny, {.tight = true, .fine = true}, progress_.Part(0.75, 0.85));
    TakeClearest();
    AddEnds(progress_.Part(0.85, 0.93));
    AddPieces();
    DoubtUnclear();
    PlaceAllShells();
    return {std::move(bones_), std::move(signs_), std::move(doubts_)};
  }

 private:
  bool IsSmall(int label) const {
    return IsSmallerThan(kSmall, *std::ranges::find(boxes_, label, &StrokeBox::label), scan_.grid);
  }

  double RiseOf(const FoundBone& bone) const {
    return OutwardRise(*calm_, marrow_.at(bone.label), bone.box, bone.mask);
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
    signs_.resize(candidates_.size());
    ParallelFor(bones_.size(), [&](size_t b) {
      std::vector<FoundBone>& candidates = candidates_[b];
      const double marrow = marrow_.at(candidates.front().label);
      const size_t clearest = ClearestBone(*calm_, marrow, candidates);
      signs_[b].agreement = Agreement(candidates, clearest);
      bones_[b] = std::move(candidates[clearest]);
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
        bones_[b] = WithEnds(bones_[b], more, *calm_, marrow, clear_rise);
    });
  }

  LabelMap Found() const {
    LabelMap found = kept_;
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
            AnswersInPieces({scan_, *calm_, strokes_, air_}, bones_[b], found, marrow, clear_rise);
        const size_t before = answers.size();
        answers.push_back(std::move(bones_[b]));
        const size_t clearest = ClearestBone(*calm_, marrow, answers);
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
      Doubt(bones_[b].label, doubt);
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
        Doubt(label,
              "hardly any dark cortex lies under the surface that was found; check it, and draw "
              "more strokes in it and around it");
      } else if (rises[b] < least) {
        Doubt(label,
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
    const VoxelBox in_scan{part.low + bone.box.low, part.high + bone.box.low};
    RoughBone rough{Cropped(scan_, in_scan), Cropped(bone.mask, part), Cropped(bone.marrow, part)};
    const double marrow = marrow_.at(bone.label);
    for (float& r : rough.relative.values) r = float(r / marrow);
    const Mask mixed = WithNeighbours(Cropped(air_, in_scan));  // the skin's outermost voxels with air
    for (size_t v = 0; v < mixed.values.size(); ++v)
      if (mixed.values[v]) rough.relative.values[v] = NAN;
    rough.small = IsSmall(bone.label);
    return rough;
  }

  void PlaceAllShells() {
    std::vector<RoughBone> rough(bones_.size());
    ParallelFor(bones_.size(), [&](size_t b) { rough[b] = Rough(bones_[b]); });
    const std::vector<PlacedShell> shells = PlaceShells(rough);
    ParallelFor(shells.size(), [&](size_t b) {
      const FoundBone before{.box = bones_[b].box, .mask = bones_[b].mask};
      const FoundBone& bone = bones_[b];
      const double marrow = marrow_.at(bone.label);
      Place(shells[b], bones_[b]);
      signs_[b].stayed = Dice(before, bone);
      signs_[b].unclear = ShareUnclear(*calm_, marrow, bone.box, bone.mask);
      signs_[b].dark_inside = DarkInside(*calm_, marrow, bone.box, bone.mask);
    });
  }

  void Place(const PlacedShell& shell, FoundBone& bone) const {
    const VoxelBox part = PartOf(bone);
    ForEachVoxel(part, bone.mask.grid, [&](const auto& p, size_t at, size_t in_box) {
      const Eigen::Vector3i v = p + part.low + bone.box.low;
      const int stroke = strokes_(v.x(), v.y(), v.z());
      bone.mask.values[in_box] = shell.mask.values[at] && (stroke == 0 || stroke == bone.label);
    });
  }

  void Doubt(int label, std::string text) { doubts_.push_back({label, std::move(text)}); }

  const Volume& scan_;
  const LabelMap& strokes_;
  const std::vector<StrokeBox>& boxes_;
  const LabelMap& kept_;
  const Progress& progress_;
  const std::map<int, double> marrow_;              // levels
  const LabelMap air_;                              // 1 in air
  const OwnOrLent<Volume> calm_;                    // what surfaces are judged by
  std::vector<std::vector<FoundBone>> candidates_;  // bone by bone
  std::vector<FoundBone> bones_;
  std::vector<SearchSigns> signs_;  // of each
  std::vector<BoneDoubt> doubts_;
};

}  // namespace

MrBones FindMrBones(const Volume& scan, const LabelMap& strokes, const std::vector<StrokeBox>& boxes,
                    const LabelMap& kept, const Progress& progress) {
  return MrSearch(scan, strokes, boxes, kept, progress).Run();
}

}  // namespace kvx
