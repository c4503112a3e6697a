// Voxels that several bones claim go to the one that leans most.
#include "pipeline/segmentation/grow_bones.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>

#include "core/errors.h"
#include "core/host/parallel.h"
#include "core/voxels/axes_order.h"
#include "pipeline/scans/grey_kind.h"
#include "pipeline/segmentation/ct/canal.h"
#include "pipeline/segmentation/ct/ct_bones.h"
#include "pipeline/segmentation/ct/part_bones.h"
#include "pipeline/segmentation/finish_bone.h"
#include "pipeline/segmentation/mr/levels/muscle_level.h"
#include "pipeline/segmentation/mr/mr_bones.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"
#include "pipeline/segmentation/strokes/stroke_doubts.h"

namespace kvx {
namespace {

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

const char kHardlyMore[] = "hardly more than the strokes was found; check it, and draw more strokes there";

const char kBareStrokes[] =
    "some strokes lie where hardly more than them was found; check there, and draw more strokes in that part";

const char kBeyond[] = "what was found goes far beyond the strokes; mark the background around it";

const char kUnlike[] =
    "the ways of looking do not agree, or hardly any dark cortex lies under the surface, so that what was "
    "found may well be too small, too large or beside the bone; look at it, and draw more strokes in the "
    "bone and around it";

const char kDarkMuscle[] =
    "muscle is nearly as dark as cortex in this scan, so that what was found may well be too large, too "
    "small or beside the bone; look at its borders, draw more strokes in it, and mark the background where "
    "it goes too far";

const char kApart[] =
    "it was found in pieces that do not touch, with strokes of it in more than one of them: a part between "
    "them may be missing, or strokes lie outside the bone; look at them, and draw strokes where it goes on";

const char kWithin[] =
    "strokes of the background or of another bone lie inside what was found of it: either they are wrong, or "
    "what is around them is none of it; look there, and mark more of it or take them away";

const char kCanal[] =
    "a part of it is as soft as muscle and goes on outside of it, as the spinal canal does, and hardly a "
    "stroke marks it; if it is none of the bone, mark it as background";

class Grower {
 public:
  Grower(const Volume& scan, const LabelMap& strokes, bool ct, const Progress& progress,
         const LabelMap* previous)
      : scan_(scan), strokes_(strokes), ct_(ct), progress_(progress), out_{LabelMap(scan.grid), {}, {}} {
    boxes_ = StrokeBoxes(strokes);
    if (boxes_.empty() && !(previous && HasBones(*previous)))
      throw InputError("the strokes mark no bone; bones are 1, 2, ... and 255 is the background");
    if (previous) Keep(*previous);
  }

  GrownBones Run() {
    if (boxes_.empty()) return std::move(out_);
    if (ct_)
      bones_ = FindCtBones(scan_, strokes_, boxes_, progress_);
    else
      FindInMr();
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

  void FindInMr() {
    const UsualMuscle usual = WithUsualMuscle(scan_, strokes_);
    MrBones found = FindMrBones(*usual.scan, strokes_, boxes_, out_.labels, progress_);
    dark_muscle_ = usual.darker;
    bones_ = std::move(found.bones);
    signs_ = std::move(found.signs);
    out_.doubts.insert(out_.doubts.end(), found.doubts.begin(), found.doubts.end());
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
      if (!ct_) Expect(finishes[b], bones_[b].label, signs_[b]);
      DoubtFinished(finishes[b], bones_[b]);
    }
    DoubtWhatIsThere();
  }

  void Expect(const BoneFinish& finish, int label, SearchSigns signs) {
    signs.marked = finish.marked, signs.bare = finish.bare, signs.dark_muscle = dark_muscle_;
    out_.expected_dice[label] = ExpectedDice(signs);
  }

  // Who has been told of a bone what to do is not told again.
  void DoubtFinished(const BoneFinish& finish, const FoundBone& bone) {
    const double dice = ct_ ? 0 : out_.expected_dice.at(bone.label);
    if (finish.bare) Warn(bone.label, kBareStrokes);
    if (finish.marked > kMostlyMarked && dice < kSureDice) Warn(bone.label, kHardlyMore);
    if (bone.reaches_box) Warn(bone.label, kBeyond);
    if (ct_ || IsTold(bone.label) || dice >= DoubtfulDice(dark_muscle_)) return;
    Warn(bone.label, dark_muscle_ > 0 ? kDarkMuscle : kUnlike);
  }
  bool IsTold(int label) const {
    return std::ranges::find(out_.doubts, label, &BoneDoubt::label) != out_.doubts.end();
  }

  // Of the bones that were looked for.
  void DoubtWhatIsThere() {
    const std::map<int, size_t> within = StrokesWithin(out_.labels, strokes_);
    const std::map<int, VoxelBox> boxes = BoxesOf(out_.labels);
    std::vector<uint8_t> apart(bones_.size(), 0), canal(bones_.size(), 0);
    ParallelFor(bones_.size(), [&](size_t b) {
      const int label = bones_[b].label;
      const auto box = boxes.find(label);
      if (box == boxes.end()) return;
      apart[b] = StrokesApart(out_.labels, strokes_, label, box->second) >= kSeveralApart;
      canal[b] = ct_ && HoldsCanal(scan_, out_.labels, strokes_, label, box->second);
    });
    for (size_t b = 0; b < bones_.size(); ++b) {
      const int label = bones_[b].label;
      const auto other = within.find(label);
      if (apart[b] && !IsTold(label)) Warn(label, kApart);
      if (other != within.end() && other->second >= kSeveralWithin) Warn(label, kWithin);
      if (canal[b]) Warn(label, kCanal);
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

  void Warn(int label, std::string_view doubt) { out_.doubts.emplace_back(label, std::string(doubt)); }

  const Volume& scan_;
  const LabelMap& strokes_;
  const bool ct_;
  const Progress& progress_;
  GrownBones out_;
  std::vector<StrokeBox> boxes_;  // of the bones to be found
  std::vector<FoundBone> bones_;
  std::vector<SearchSigns> signs_;  // of each, in MR
  double dark_muscle_ = 0;          // UsualMuscle::darker
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
