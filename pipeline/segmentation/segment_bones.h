// Stage: strokes on the template, or a threshold of a CT, become the template's bone label map.
#pragma once
#include "core/proposed_bone.h"
#include "core/study.h"
#include "pipeline/runner.h"
#include "pipeline/segmentation/strokes/bone_doubt.h"

namespace kvx {

struct SegmentedBones {
  LabelMap labels;                    // on the template's grid
  std::vector<std::string> warnings;  // what is doubtful in the whole, and what to do
  bool numbered_by_size = false;      // by threshold; else by the strokes
  std::vector<BoneDoubt> doubts;
  std::map<int, double> expected_dice;  // by label, with the true bone; of bones found in an MR
};
template <class A>
void Fields(A& a, SegmentedBones& v) {
  a(v.labels, v.warnings, v.numbered_by_size, v.doubts, v.expected_dice);
}

struct SegmentBones {
  static constexpr std::string_view kName = "segment";
  static constexpr int kVersion = 27;
  struct Inputs {
    const Artifact<Scan>& scan;
    Digest strokes_content;              // ContentDigest(strokes_path); zero without strokes
    std::filesystem::path strokes_path;  // empty: by threshold
    // Labels that fewer strokes gave, on the template's grid; bones that the strokes agree with keep theirs,
    // others without strokes all that no stroke contradicts.
    Digest previous_content = {};
    std::filesystem::path previous_path = {};  // empty: from scratch
    std::vector<Digest> Keys() const { return {scan.key, strokes_content, previous_content}; }
  };
  struct Options {
    std::optional<double> level_hu;  // by threshold; none: found in the scan
    std::vector<int> listed;         // labels that strokes may have beside the background's; empty: any
  };
  using Output = SegmentedBones;
  // Throws InputError: no strokes of a bone, and of the background neither where there are previous labels;
  // previous labels of another grid, a threshold for a scan that is no CT, nothing above the threshold, a
  // threshold below muscle.
  static Output Run(const Inputs& inputs, const Options& options, StageContext& context);
};
template <class A>
void Fields(A& a, SegmentBones::Options& v) {
  a(v.level_hu, v.listed);
}

// Throws InputError for a scan that is no CT, for one that holds nothing above the level, and for a level
// below muscle.
void RequireThreshold(const Scan& scan, std::optional<double> level_hu);

// Throws InputError for labels that are not on the template's grid, and for a scan.
LabelMap ReadPreviousLabels(const std::filesystem::path& path, const Grid& template_grid);

// Which bone each label is: strokes carry the numbers of the preset's bones,
// a threshold's labels get proposals.
std::vector<ProposedBone> NamesOf(const SegmentedBones& bones, Region region);

// Of the whole, then of each bone, by its name where one is given.
std::vector<std::string> WarningsOf(const SegmentedBones& bones, const std::map<int, std::string>& names);

// By the names that are sure.
std::vector<std::string> WarningsOf(const SegmentedBones& bones, const std::vector<ProposedBone>& named);

}  // namespace kvx
