// Stage `bones`: a label map on any grid becomes the template's bones, with their tree and oriented boxes. A
// finished map is mended first (`segmentation/mend_labels.h`); a label of no bone that a bone encloses is
// bone: marrow, of tools that tell it from cortex.
#pragma once
#include "pipeline/runner.h"
#include "pipeline/segmentation/segment_bones.h"

namespace kvx {

struct BuildBoneSet {
  static constexpr std::string_view kName = "bones";
  static constexpr int kVersion = 6;
  struct Inputs {
    const Artifact<Scan>& template_scan;
    Digest labels_content;  // ContentDigest(labels_path)
    std::filesystem::path labels_path;
    const Artifact<SegmentedBones>* segmented = nullptr;  // instead of a file, its key in labels_content
    std::vector<Digest> Keys() const { return {template_scan.key, labels_content}; }
  };
  struct Options {
    Region region = Region::kCustom;
    std::vector<StudyBone> bones;  // empty: the preset's names for labels 1, 2, ... in its order
  };
  using Output = BoneSet;
  // Throws InputError: a scan for a label map, a listed label without voxels,
  // a parent that is not listed, a cycle, two roots, duplicate names.
  static Output Run(const Inputs& inputs, const Options& options, StageContext& context);
};
template <class A>
void Fields(A& a, BuildBoneSet::Options& v) {
  a(v.region, v.bones);
}

}  // namespace kvx
