// Levels, margins, samples.
#include "pipeline/bones/template/sought_bones.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "core/voxels/distance_map.h"
#include "pipeline/bones/images/levels.h"

namespace kvx {
namespace {

// A bone is searched at the coarsest level that has so many across its thickness
constexpr double kVoxelsAcross = 4.0;
constexpr size_t kFew = 250, kMany = 3000;  // samples of the coarse scores and of the last refinement
// Nobody knows where the root is: what surrounds it, which moves nearly with it, tells it from other bones.
constexpr double kWideMarginMm = 15;
constexpr size_t kRootSamples = 500;

double MarginMm(double level_mm, const BoneShape& shape, double finest_mm) {
  return std::max(1.5 * finest_mm, std::min(1.5 * level_mm, 0.25 * shape.thickness_mm));
}

int FirstLevel(const BoneShape& shape, const std::vector<double>& level_mm) {
  int level = 0;
  while (level + 1 < int(level_mm.size()) && shape.thickness_mm >= kVoxelsAcross * level_mm[level + 1])
    ++level;
  return level;
}

}  // namespace

SoughtBones::SoughtBones(const BoneSet& bones, const Volume& template_volume, double finest_mm, int levels)
    : bones_(bones) {
  for (int level = 0; level < levels; ++level) level_mm_.push_back(finest_mm * (1 << level));
  anatomy_ = StudyShapes(bones, 1.5 * level_mm_.back() + finest_mm);
  for (const Bone& bone : bones.bones) independent_.push_back(IndependentSamples(bone));
  for (const BoneShape& shape : anatomy_.bones) first_level_.push_back(FirstLevel(shape, level_mm_));
  const std::vector<Volume> template_levels = MakeLevels(template_volume, CoarserLevelsMm());
  samples_.resize(bones.size());
  ParallelFor(bones.size(), [&](size_t b) {
    for (int level = 0; level < levels; ++level) {
      const double margin_mm = MarginMm(level_mm_[level], anatomy_.bones[b], finest_mm);
      for (const size_t count : {kFew, kMany >> level}) {
        samples_[b].push_back(SampleBone(anatomy_.bones[b], bones.labels, bones.bones[b].label,
                                         template_levels[level], margin_mm, count));
      }
    }
  });
  root_samples_ = WideSamples(0, template_levels[first_level_[0]], kRootSamples);
}

BoneSamples SoughtBones::WideSamples(int bone, const Volume& values, size_t count) const {
  const int label = bones_.bones[bone].label;
  BoneShape wide = anatomy_.bones[bone];
  wide.distance_mm = SignedDistance(bones_.labels, label, kWideMarginMm);
  return SampleBone(wide, bones_.labels, label, values, kWideMarginMm, count, true);
}

}  // namespace kvx
