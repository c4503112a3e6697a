// What is looked for in a scan: the template's bones, their shapes and joints, and samples of them at voxels
// of several sizes.
#pragma once
#include <vector>

#include "core/bone.h"
#include "pipeline/bones/template/bone_samples.h"
#include "pipeline/bones/template/bone_shape.h"

namespace kvx {

class SoughtBones {
 public:
  static constexpr int kMostLevels = 3;
  // Voxels of the finest level are of this size, those of each next one twice as wide. Keeps a reference to
  // the bones.
  SoughtBones(const BoneSet& bones, const Volume& template_volume, double finest_mm,
              int levels = kMostLevels);

  const BoneSet& bones() const { return bones_; }
  const Anatomy& anatomy() const { return anatomy_; }
  const std::vector<double>& independent_samples() const { return independent_; }
  std::vector<double> CoarserLevelsMm() const { return {level_mm_.begin() + 1, level_mm_.end()}; }
  bool IsRoot(int bone) const { return bones_.bones[bone].parent == kNoParent; }
  // At which a bone is looked for first: the coarsest that shows it.
  int FirstLevelOf(int bone) const { return first_level_[bone]; }
  double FirstLevelMm(int bone) const { return level_mm_[first_level_[bone]]; }
  const BoneSamples& FirstSamplesOf(int bone) const {
    return IsRoot(bone) ? root_samples_ : SamplesOf(bone, first_level_[bone], false);
  }
  const BoneSamples& SamplesOf(int bone, int level, bool many) const {
    return samples_[bone][2 * level + many];
  }
  // A bone and what surrounds it, other bones too.
  BoneSamples WideSamples(int bone, const Volume& values, size_t count) const;

 private:
  const BoneSet& bones_;
  Anatomy anatomy_;
  std::vector<double> level_mm_;
  std::vector<int> first_level_;                   // per bone
  std::vector<std::vector<BoneSamples>> samples_;  // per bone, per level: few, many
  BoneSamples root_samples_;                       // with a wide margin, at the root's first level
  std::vector<double> independent_;                // per bone
};

}  // namespace kvx
